//! Development only: makes what the repository ships. Run it at the root of the repository.
//!
//! | command | writes |
//! |---|---|
//! | `cargo run -p palpate-workshop -- objects` | the sixteen objects below `assets/objects`, byte for byte the same |
//! | `cargo run -p palpate-workshop -- thumbnails` | their thumbnails, drawn from the built-in objects |
//! | `cargo run --release -p palpate-workshop -- model [--any-gripper] --store FILE` | a recognition model below `models`, with its card |
//! | `cargo run --release -p palpate-workshop -- encoder [--any-gripper]` | a geometry encoder below `models` |
//! | `cargo run --release -p palpate-workshop -- signatures --store FILE` | the class signatures of that model; its weights stay |
//! | `cargo run -p palpate-workshop -- tables` | tables of the manual and the README and the picture of the study of accuracy, from stored results in `assets/studies` |
//! | `cargo run --release -p palpate-workshop -- fuzz SECONDS` | nothing: feeds random bytes to the protocol decoder and checks its events |
//!
//! Dimensions are real-world ones, chosen to match the names of the paper's objects, whose sizes it does not publish.
//! Objects lie as placed: z up, long side along y, so that the fingers close across it along x.

mod encoder;
mod fuzz;
mod fuzz_stream;
mod live_model;
mod sixteen;
mod thumbnails;
mod tools;

use clap::{Parser, Subcommand};
use palpate_geometry::palette::Theme;
use palpate_geometry::{ColouredPart, Finish, MassProperties, Primitive, TriMesh, mass_properties, write_obj};
use palpate_learn::Shipped;
use palpate_render::figure_svg;
use palpate_sim::objects::{ShapeClass, SizeClass};
use palpate_store::Store;
use palpate_study::accuracy::stored_accuracy;
use palpate_study::generated_sections;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use tools::Parts;

/// How the physics sees an object.
enum Body {
    /// Primitives placed by position (m) and roll, pitch, yaw (rad).
    Primitives(Vec<(Primitive, [f64; 3], [f64; 3])>),
    /// A closed mesh.
    Mesh(TriMesh),
}

/// Everything that makes an object.
struct Thing {
    name: &'static str,
    title: &'static str,
    size: SizeClass,
    shape: ShapeClass,
    /// Mass (kg).
    mass: f64,
    friction: f64,
    look: Parts,
    body: Body,
}

/// A file to be written: its path below the output folder, and its text.
type MadeFile = (String, String);

/// Any failure, as a sentence.
type Failure = Box<dyn std::error::Error>;

/// Makes what the repository ships.
#[derive(Debug, Parser)]
#[command(name = "palpate-workshop")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write the built-in objects, one folder each.
    Objects {
        /// Output folder.
        #[arg(long, default_value = "assets/objects")]
        out: PathBuf,
    },
    /// Draw the thumbnails of the built-in objects.
    Thumbnails {
        /// Output folder.
        #[arg(long, default_value = "assets/objects")]
        out: PathBuf,
    },
    /// Collect grasps and train a shipped recognition model.
    Model(ForModel),
    /// Collect the training grasps again and store their class signatures in the shipped model, whose weights stay.
    Signatures {
        /// Folder of the model.
        #[arg(long, default_value = "models")]
        out: PathBuf,
        /// Trial store that receives the grasps; a second run reuses them.
        #[arg(long)]
        store: PathBuf,
    },
    /// Collect the grasps in known poses that guide the next grasp.
    Touches(ForModel),
    /// Grasp random shapes, and train a shipped geometry encoder on them.
    Encoder {
        /// The one for real sensors on any gripper, instead of the one for perfect sensors.
        #[arg(long)]
        any_gripper: bool,
        /// Output folder.
        #[arg(long, default_value = "models")]
        out: PathBuf,
        /// Number of shapes.
        #[arg(long, default_value_t = 1000)]
        shapes: u64,
        /// Poses of each shape, grasped free and fixed.
        #[arg(long, default_value_t = 3)]
        poses: u64,
    },
    /// Write the tables of the manual and the README, and the picture of the study of accuracy, from stored results.
    Tables,
    /// Feed random bytes to the protocol decoder and check its events.
    Fuzz {
        /// Duration (s).
        seconds: f64,
    },
}

/// Shipped model that is made, or that files are made for: the one for perfect sensors and free objects, or another.
#[derive(Debug, clap::Args)]
struct ForModel {
    /// The one for any gripper.
    #[arg(long)]
    any_gripper: bool,
    /// The one for fixed objects.
    #[arg(long, conflicts_with = "any_gripper")]
    fixed: bool,
    /// Output folder.
    #[arg(long, default_value = "models")]
    out: PathBuf,
    /// Trial store that receives the grasps; a second run reuses them.
    #[arg(long)]
    store: PathBuf,
}

fn main() -> Result<(), Failure> {
    match Arguments::parse().command {
        Command::Objects { out } => {
            let files = make_all();
            for (path, text) in &files {
                let path = out.join(path);
                if let Some(folder) = path.parent() {
                    std::fs::create_dir_all(folder)?;
                }
                std::fs::write(path, text)?;
            }
            report(format_args!("{} files in {}", files.len(), out.display()));
        }
        Command::Thumbnails { out } => {
            let count = thumbnails::draw_all(&out)?;
            report(format_args!("{count} thumbnails in {}", out.display()));
        }
        Command::Model(ForModel { any_gripper, fixed, out, store }) => {
            live_model::make(shipped(any_gripper, fixed), &out, &mut Store::open(&store)?)?;
        }
        Command::Touches(ForModel { any_gripper, fixed, out, store }) => {
            live_model::make_touches(shipped(any_gripper, fixed), &out, &mut Store::open(&store)?)?;
        }
        Command::Signatures { out, store } => live_model::add_signatures(&out, &mut Store::open(&store)?)?,
        Command::Encoder { any_gripper, out, shapes, poses } => {
            encoder::make(shipped(any_gripper, false), &out, shapes, poses)?;
        }
        Command::Tables => write_tables()?,
        Command::Fuzz { seconds } => fuzz::run(seconds)?,
    }
    Ok(())
}

fn shipped(any_gripper: bool, fixed: bool) -> Shipped {
    if any_gripper { Shipped::AnyGripper } else { Shipped::simulated(fixed) }
}

fn write_tables() -> Result<(), Failure> {
    for section in generated_sections()? {
        let path = Path::new(section.document);
        let without = || format!("\"{}\" has no section \"{}\"", section.document, section.name);
        let text = section.put_into(&std::fs::read_to_string(path)?).ok_or_else(without)?;
        std::fs::write(path, text)?;
        report(format_args!("{} in {}", section.name, section.document));
    }
    let picture = "assets/studies/accuracy.svg";
    if let Some(stored) = stored_accuracy() {
        let linked = stored.result.figure().with_note(&stored.plain_origin());
        std::fs::write(picture, figure_svg(&linked.figure, Theme::Light, linked.size)?)?;
        report(format_args!("{picture}"));
    }
    Ok(())
}

#[expect(clippy::print_stdout, reason = "results of a headless command")]
fn report(line: std::fmt::Arguments<'_>) {
    println!("{line}");
}

/// All files of all objects, in order of name.
fn make_all() -> Vec<MadeFile> {
    sixteen::all().iter().flat_map(files_of).collect()
}

fn files_of(thing: &Thing) -> Vec<MadeFile> {
    let name = thing.name;
    let parts: Vec<(&str, ColouredPart)> = thing.look.0.iter().map(|(n, p)| (n.as_str(), p.clone())).collect();
    let (obj, mtl) = write_obj(thing.title, &format!("{name}.mtl"), &parts);
    let mut files = vec![
        (format!("{name}/{name}.obj"), obj),
        (format!("{name}/{name}.mtl"), mtl),
        (format!("{name}/{name}.urdf"), urdf_of(thing)),
        (format!("{name}/facts.toml"), facts_of(thing)),
    ];
    if let Body::Mesh(mesh) = &thing.body {
        let part = ColouredPart { mesh: mesh.clone(), colour: None, finish: Finish::default() };
        let title = format!("{}: what is touched", thing.title);
        let (obj, _) = write_obj(&title, &format!("{name}.mtl"), &[("body", part)]);
        // The collision mesh has no look of its own.
        let plain: String = obj.lines().filter(|l| !l.starts_with("mtllib") && !l.starts_with("usemtl")).fold(
            String::new(),
            |mut text, line| {
                text.push_str(line);
                text.push('\n');
                text
            },
        );
        files.push((format!("{name}/{name}_collision.obj"), plain));
    }
    files
}

fn facts_of(thing: &Thing) -> String {
    let (size, shape) = (thing.size.name(), thing.shape.name());
    format!("title = \"{}\"\nsize = \"{size}\"\nshape = \"{shape}\"\nfriction = {}\n", thing.title, thing.friction)
}

fn urdf_of(thing: &Thing) -> String {
    let name = thing.name;
    let mass = body_mass(&thing.body).with_mass(thing.mass);
    let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{name}\">\n  <link name=\"{name}\">\n");
    let centre = triple(mass.centre.to_array());
    let i = mass.inertia;
    let term = |value: f64| {
        // Products of inertia of symmetric bodies are rounding noise.
        if value.abs() < 1e-4 * i.x_axis.x { "0".to_owned() } else { format!("{value:.4e}") }
    };
    // Writing to a String cannot fail.
    let _infallible = writeln!(
        text,
        "    <inertial>\n      <origin xyz=\"{centre}\"/>\n      <mass value=\"{}\"/>\n      \
         <inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/>\n    </inertial>",
        thing.mass,
        term(i.x_axis.x),
        term(i.x_axis.y),
        term(i.x_axis.z),
        term(i.y_axis.y),
        term(i.y_axis.z),
        term(i.z_axis.z),
    );
    let _infallible = writeln!(
        text,
        "    <visual>\n      <geometry>\n        <mesh filename=\"{name}.obj\"/>\n      </geometry>\n    </visual>"
    );
    match &thing.body {
        Body::Primitives(shapes) => {
            for (shape, xyz, rpy) in shapes {
                let _infallible = writeln!(
                    text,
                    "    <collision>\n      <origin xyz=\"{}\" rpy=\"{}\"/>\n      <geometry>\n        {}\n      \
                     </geometry>\n    </collision>",
                    triple(*xyz),
                    triple(*rpy),
                    primitive_tag(shape),
                );
            }
        }
        Body::Mesh(_) => {
            let _infallible = writeln!(
                text,
                "    <collision>\n      <geometry>\n        <mesh filename=\"{name}_collision.obj\"/>\n      \
                 </geometry>\n    </collision>"
            );
        }
    }
    text.push_str("  </link>\n</robot>\n");
    text
}

fn triple(v: [f64; 3]) -> String {
    let number = |x: f64| {
        let text = format!("{x:.7}");
        let text = text.trim_end_matches('0').trim_end_matches('.');
        if text == "-0" { "0".to_owned() } else { text.to_owned() }
    };
    v.map(number).join(" ")
}

fn primitive_tag(shape: &Primitive) -> String {
    match *shape {
        Primitive::Sphere { radius } => format!("<sphere radius=\"{radius}\"/>"),
        Primitive::Cuboid { half } => format!("<box size=\"{}\"/>", triple((half * 2.0).to_array())),
        Primitive::Cylinder { radius, half_length } => {
            format!("<cylinder radius=\"{radius}\" length=\"{}\"/>", 2.0 * half_length)
        }
        Primitive::Capsule { radius, half_length } => {
            format!("<capsule radius=\"{radius}\" length=\"{}\"/>", 2.0 * half_length)
        }
    }
}

fn body_mass(body: &Body) -> MassProperties {
    use glam::DVec3;
    use palpate_geometry::Pose;
    match body {
        Body::Mesh(mesh) => mass_properties(mesh, 1.0),
        Body::Primitives(shapes) => shapes.iter().fold(MassProperties::ZERO, |sum, (shape, xyz, rpy)| {
            let place = Pose::from_xyz_rpy(DVec3::from_array(*xyz), DVec3::from_array(*rpy));
            sum.welded_to(&shape.mass_properties().seen_from(&place))
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_committed_objects_are_what_the_workshop_makes() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/objects");
        let files = make_all();
        for (path, text) in &files {
            let committed = std::fs::read_to_string(folder.join(path)).unwrap_or_default();
            assert!(committed == *text, "{path} differs: run `cargo run -p palpate-workshop -- objects`");
        }
        let mut on_disk = 0;
        for object in std::fs::read_dir(folder).unwrap() {
            on_disk += std::fs::read_dir(object.unwrap().path()).unwrap().count();
        }
        assert_eq!(on_disk, files.len() + 16, "the made files, and a thumbnail each");
    }
}
