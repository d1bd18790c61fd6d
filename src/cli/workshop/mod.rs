//! Where the sixteen built-in objects are made: `palpate workshop --out assets/objects` writes their folders anew,
//! byte for byte the same. Dimensions are real-world ones, chosen to match the names of the paper's objects, whose
//! sizes it does not publish.
//!
//! Objects lie as they are put down: z up, their long side along y, so that the fingers close across it along x.

mod fuzz_wire;
mod live_model;
mod sixteen;
mod thumbnails;
mod tools;

use super::Failure;
use super::setup::open_store;
use super::terminal::say;
use palpate_geometry::{ColouredPart, MassProperties, Primitive, TriMesh, mass_properties, write_obj};
use palpate_sim::objects::{ShapeClass, SizeClass};
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

/// Arguments of `palpate workshop`.
#[derive(Debug, clap::Args)]
pub(super) struct WorkshopArguments {
    /// The folder that gets one folder per object.
    #[arg(long, value_name = "FOLDER", default_value = "assets/objects")]
    out: PathBuf,
    /// Draw the thumbnails of the objects that this program was built with, instead of the objects.
    #[arg(long)]
    thumbnails: bool,
    /// Make the model that comes with the program, from grasps collected into the store, instead of the objects.
    #[arg(long, conflicts_with = "thumbnails")]
    model: bool,
    /// Listen to bytes that no board should send, for this long (s), and check what is made of them.
    #[arg(long, value_name = "SECONDS", conflicts_with_all = ["thumbnails", "model"])]
    fuzz_wire: Option<f64>,
}

pub(super) fn run(arguments: &WorkshopArguments, store: Option<&Path>) -> Result<(), Failure> {
    if let Some(seconds) = arguments.fuzz_wire {
        return fuzz_wire::run(seconds);
    }
    if arguments.model {
        return live_model::make(&arguments.out, &mut open_store(store)?);
    }
    if arguments.thumbnails {
        let count = thumbnails::draw_all(&arguments.out)?;
        return say(format!("{count} thumbnails in {}", arguments.out.display()));
    }
    let files = make_all();
    for (path, text) in &files {
        let path = arguments.out.join(path);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        std::fs::write(path, text)?;
    }
    say(format!("{} files in {}", files.len(), arguments.out.display()))
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
        let part = ColouredPart { mesh: mesh.clone(), colour: None };
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
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/objects");
        let files = make_all();
        for (path, text) in &files {
            let committed = std::fs::read_to_string(folder.join(path)).unwrap_or_default();
            assert!(committed == *text, "{path} differs: run `palpate workshop`");
        }
        let mut on_disk = 0;
        for object in std::fs::read_dir(folder).unwrap() {
            on_disk += std::fs::read_dir(object.unwrap().path()).unwrap().count();
        }
        assert_eq!(on_disk, files.len() + 16, "the made files, and a thumbnail each");
    }
}
