//! URDF files: every link's shapes and masses, gathered in the frame of the root link. Fixed joints weld; movable
//! ones are welded at zero, with a warning, since a grasped object is one rigid body here.
//!
//! Files in the wild leave out names, colours and inertia terms, separate numbers by commas, and hold gazebo, sensor
//! and transmission blocks: missing items are filled in, unused ones are skipped, and essential ones that are missing
//! or unknown becomes a warning or an error.

use super::ObjectError;
use super::assemble::{Blueprint, Inertial, ShapeSource};
use super::xml::{self, Element};
use glam::{DMat3, DQuat, DVec3};
use palpate_geometry::palette::Rgb;
use palpate_geometry::{ColouredPart, MassProperties, MeshFileError, Pose, Primitive, other_content, text_of};
use std::collections::HashMap;

/// Reads meshes by the reference that the URDF makes to them.
pub(super) type MeshReader<'a> = &'a dyn Fn(&str) -> Result<Vec<ColouredPart>, MeshFileError>;

/// Moduli of elasticity that a surface can have (Pa).
const MODULI: std::ops::RangeInclusive<f64> = 100.0..=1e12;

/// Link, joint or material with its name.
type Named<'a> = (String, &'a Element);

/// Masses that a link may have (kg); frames without a body are often given next to nothing.
const USABLE_MASS: std::ops::RangeInclusive<f64> = 1e-30..=1e4;

/// Connection of two links.
struct Joint<'a> {
    name: String,
    parent: &'a str,
    child: &'a str,
    parent_from_child: Pose,
}

/// Parses the bytes of a URDF.
pub(super) fn parse(name: &str, bytes: &[u8], read_mesh: MeshReader<'_>) -> Result<Blueprint, ObjectError> {
    let malformed = |cause: String| ObjectError::malformed(name, &cause);
    let in_file = |cause: ObjectError| ObjectError(format!("\"{name}\": {cause}"));
    let robot = robot_of(bytes).map_err(malformed)?;
    let mut blueprint = Blueprint::new(name);
    blueprint.robot = robot.attribute("name").map(str::to_owned);
    let links = named(&robot, "link");
    let twice = links.iter().enumerate().find(|(k, link)| links[..*k].iter().any(|other| other.0 == link.0));
    if let Some((_, (name, _))) = twice {
        return Err(malformed(format!("two links are called \"{name}\"; give each a name of its own")));
    }
    let joints = joints_of(&robot, &mut blueprint.warnings).map_err(malformed)?;
    let poses = link_poses(&links, &joints, &mut blueprint.warnings).map_err(malformed)?;
    let materials = named(&robot, "material");
    let colour_named =
        |name: &str| materials.iter().rev().filter(|(own, _)| own == name).find_map(|(_, m)| colour_of(m));
    // Sums must not depend on the order in which a file names its links.
    let mut in_order: Vec<&Named<'_>> = links.iter().collect();
    in_order.sort_by(|a, b| a.0.cmp(&b.0));
    for (link, element) in in_order {
        let Some(root_from_link) = poses.get(link.as_str()) else {
            continue;
        };
        blueprint.link.clone_from(link);
        let visuals = shape_tags(link, element, "visual", &mut blueprint.warnings);
        let collisions = shape_tags(link, element, "collision", &mut blueprint.warnings);
        let mut seen = 0;
        for (visual, shape) in &visuals {
            let material = visual.child("material");
            let colour = material.and_then(|m| colour_of(m).or_else(|| colour_named(m.attribute("name")?)));
            let place = *root_from_link * origin_of(visual, link).map_err(malformed)?;
            match shape_of(shape, link, read_mesh) {
                Ok(shape) => {
                    blueprint.add_visual(&shape, &place, colour);
                    seen += 1;
                }
                // The collision shape is drawn in place of a missing visual.
                Err(error) if !collisions.is_empty() => blueprint.warnings.push(error.to_string()),
                Err(error) => return Err(in_file(error)),
            }
        }
        for (collision, shape) in &collisions {
            let place = *root_from_link * origin_of(collision, link).map_err(malformed)?;
            match shape_of(shape, link, read_mesh) {
                Ok(shape) => blueprint.add_collision(&shape, &place),
                // What is seen is touched in place of a collision shape that cannot be read.
                Err(error) if seen > 0 && collisions.len() == 1 => {
                    blueprint
                        .warnings
                        .push(format!("{error}; the visual shape of link \"{link}\" is used in its place"));
                    blueprint.touch_visual(seen);
                }
                Err(error) => return Err(in_file(error)),
            }
            note_modulus(collision, link, &mut blueprint);
        }
        note_friction(&robot, link, element, &mut blueprint);
        let own = inertial_of(link, element, &mut blueprint.warnings).map_err(malformed)?;
        if !(visuals.is_empty() && collisions.is_empty()) || own.is_some_and(|(mass, _)| mass.mass != 0.0) {
            let possible = own.filter(|(own, _)| USABLE_MASS.contains(&own.mass));
            let declared = possible.map(|(own, place)| own.seen_from(&(*root_from_link * place)));
            blueprint.inertials.push(Inertial { link: link.clone(), declared });
        }
    }
    Ok(blueprint)
}

/// The `<robot>` of a file. The error names the fault.
fn robot_of(bytes: &[u8]) -> Result<Element, String> {
    if let Some(what) = other_content(bytes) {
        return Err(what.to_owned());
    }
    let text = text_of(bytes);
    let text = text.trim_start_matches('\u{feff}').trim_start();
    if text.contains("${") || text.contains("$(") || text.contains("<xacro:") {
        return Err("it is a xacro template, not a URDF; run `xacro FILE > object.urdf` first".to_owned());
    }
    let robot = xml::parse(text)?;
    match robot.name.as_str() {
        "robot" => Ok(robot),
        "sdf" => Err("it is an SDF file; Palpate reads URDF, OBJ and STL".to_owned()),
        other => Err(format!("its outermost element is <{other}>, not <robot>; it is not a URDF")),
    }
}

/// Parts of a robot of one kind. A nameless one is named by its place in the file.
fn named<'a>(robot: &'a Element, kind: &str) -> Vec<Named<'a>> {
    let parts = robot.children.iter().filter(|part| ["link", "joint", "material"].contains(&part.name.as_str()));
    let with_name = |(k, part): (usize, &'a Element)| {
        let name = part.attribute("name").map_or_else(|| format!("{kind}_{k}"), str::to_owned);
        (part.name == kind).then_some((name, part))
    };
    parts.enumerate().filter_map(with_name).collect()
}

fn joints_of<'a>(robot: &'a Element, warnings: &mut Vec<String>) -> Result<Vec<Joint<'a>>, String> {
    let mut joints = Vec::new();
    for (name, element) in named(robot, "joint") {
        let [parent, child] = ["parent", "child"].map(|end| element.child(end).and_then(|e| e.attribute("link")));
        let (Some(parent), Some(child)) = (parent, child) else {
            warnings.push(format!("joint \"{name}\" names no parent or no child and was left out"));
            continue;
        };
        let mut parent_from_child = origin_of(element, &name)?;
        let kind = element.attribute("type").unwrap_or("fixed");
        if kind != "fixed" {
            let (position, why) = rest_of(robot, element);
            let said = if position == 0.0 { "its zero position".to_owned() } else { format!("{position} ({why})") };
            warnings.push(format!("joint \"{name}\" is {kind}; it was welded at {said}"));
            let axis = element.child("axis").and_then(|axis| axis.attribute("xyz")).and_then(numbers);
            let axis = axis.map_or(DVec3::X, DVec3::from_array);
            if axis.try_normalize().is_none() {
                warnings.push(format!("joint \"{name}\" has no axis of any length; x is taken"));
            }
            let axis = axis.normalize_or(DVec3::X);
            let moved = match kind {
                "prismatic" => Pose::from_position(axis * position),
                _ => Pose::new(DVec3::ZERO, DQuat::from_axis_angle(axis, position)),
            };
            parent_from_child = parent_from_child * moved;
        }
        joints.push(Joint { name, parent, child, parent_from_child });
    }
    Ok(joints)
}

/// Position at which a movable joint stands (m or rad), and why: zero where its limits allow that, else the nearest limit; one
/// that mimics another follows it.
fn rest_of(robot: &Element, joint: &Element) -> (f64, &'static str) {
    let number = |element: Option<&Element>, key: &str| {
        element.and_then(|element| element.attribute(key)?.trim().parse::<f64>().ok()).filter(|value| value.is_finite())
    };
    let own = |joint: &Element| {
        let limit = joint.child("limit").filter(|_| joint.attribute("type") != Some("continuous"));
        let [lower, upper] = ["lower", "upper"].map(|key| number(limit, key));
        0f64.max(lower.unwrap_or(f64::NEG_INFINITY)).min(upper.unwrap_or(f64::INFINITY))
    };
    let Some(mimic) = joint.child("mimic") else { return (own(joint), "the limit that is nearest to zero") };
    let followed = named(robot, "joint").into_iter().find(|(name, _)| Some(name.as_str()) == mimic.attribute("joint"));
    let position = followed.map_or(0.0, |(_, other)| own(other));
    let [times, plus] =
        [("multiplier", 1.0), ("offset", 0.0)].map(|(key, usual)| number(Some(mimic), key).unwrap_or(usual));
    (times * position + plus, "as the joint that it mimics says")
}

/// Pose of each link in the frame of the root. Loops and second parents are refused.
fn link_poses<'a>(
    links: &'a [Named<'_>],
    joints: &'a [Joint<'_>],
    warnings: &mut Vec<String>,
) -> Result<HashMap<&'a str, Pose>, String> {
    let mut parent_of: HashMap<&str, &Joint<'_>> = HashMap::new();
    for joint in joints {
        for end in [joint.parent, joint.child] {
            if !links.iter().any(|(name, _)| name == end) {
                return Err(format!("joint \"{}\" refers to a link \"{end}\" that does not exist", joint.name));
            }
        }
        if let Some(other) = parent_of.insert(joint.child, joint) {
            let child = joint.child;
            return Err(format!("link \"{child}\" hangs from two joints, \"{}\" and \"{}\"", other.name, joint.name));
        }
    }
    let roots: Vec<&str> =
        links.iter().map(|(name, _)| name.as_str()).filter(|name| !parent_of.contains_key(name)).collect();
    let Some(root) = roots.first() else {
        return Err(if links.is_empty() {
            "it has no links".to_owned()
        } else {
            "its joints form a loop: no link is the root".to_owned()
        });
    };
    for other in &roots[1..] {
        warnings.push(format!("link \"{other}\" is not joined to \"{root}\"; it stays at its own origin"));
    }
    let mut poses: HashMap<&str, Pose> = roots.iter().map(|name| (*name, Pose::IDENTITY)).collect();
    for (link, _) in links {
        // Up to the nearest link already placed, then back down.
        let mut chain: Vec<&Joint<'_>> = Vec::new();
        let mut at = link.as_str();
        while !poses.contains_key(at) {
            let Some(joint) = parent_of.get(at) else { break };
            if chain.len() > links.len() {
                return Err(format!("the joints around link \"{at}\" form a loop"));
            }
            chain.push(joint);
            at = joint.parent;
        }
        for joint in chain.into_iter().rev() {
            let place = poses[joint.parent] * joint.parent_from_child;
            poses.insert(joint.child, place);
        }
    }
    Ok(poses)
}

/// Numbers separated by blanks, commas or semicolons, where there are exactly N of them.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let words = text.split([',', ';', ' ', '\t', '\n', '\r']);
    words.filter_map(|word| word.parse().ok()).collect::<Vec<f64>>().try_into().ok()
}

/// What stands in place of a number, behind a colon.
fn instead(text: &str) -> String {
    match decimal_comma(text) {
        none if none.is_empty() => format!(": \"{}\"", text.chars().take(40).collect::<String>()),
        said => said,
    }
}

/// What is wrong with numbers that have decimal commas; empty for others.
fn decimal_comma(text: &str) -> String {
    let mut words = text.split_whitespace();
    if !words.any(|word| {
        word.split_once(',').is_some_and(|(a, b)| !a.is_empty() && b.starts_with(|c: char| c.is_ascii_digit()))
    }) {
        return String::new();
    }
    format!(": \"{}\" has decimal commas; write decimal points", text.chars().take(40).collect::<String>())
}

/// Notes the modulus of a collision shape: Drake's `drake:hydroelastic_modulus`. Of several shapes the softest counts.
fn note_modulus(collision: &Element, link: &str, blueprint: &mut Blueprint) {
    let properties = collision.child("proximity_properties");
    let Some(modulus) = properties.and_then(|all| all.child("hydroelastic_modulus")) else { return };
    match modulus.attribute("value").and_then(|text| text.trim().parse::<f64>().ok()) {
        Some(value) if MODULI.contains(&value) => {
            blueprint.modulus = Some(blueprint.modulus.map_or(value, |known| known.min(value)));
        }
        _ => blueprint.warnings.push(format!(
            "link \"{link}\": its hydroelastic_modulus is not between {} and {} Pa; the object is taken to be rigid",
            MODULI.start(),
            MODULI.end()
        )),
    }
}

/// Coefficients of friction that a surface can have.
const FRICTIONS: std::ops::RangeInclusive<f64> = 0.0..=10.0;

/// Notes the friction of a link in any of three dialects: pybullet's `<contact>`, Gazebo's `<mu1>` and `<mu2>`, Drake's
/// `mu_static` and `mu_dynamic`. Of several the lowest counts.
fn note_friction(robot: &Element, link: &str, element: &Element, blueprint: &mut Blueprint) {
    let value = |element: &'_ Element| element.attribute("value").map(str::trim).map(str::to_owned);
    let mut texts: Vec<(&'static str, String)> = Vec::new();
    let lateral = element.child("contact").and_then(|contact| contact.child("lateral_friction"));
    texts.extend(lateral.and_then(value).map(|text| ("lateral_friction", text)));
    let gazebo =
        robot.children.iter().filter(|part| part.name == "gazebo" && part.attribute("reference") == Some(link));
    for own in gazebo {
        for key in ["mu1", "mu2"] {
            texts.extend(own.child(key).map(|mu| (key, mu.text.trim().to_owned())));
        }
    }
    for collision in element.children.iter().filter(|child| child.name == "collision") {
        let Some(properties) = collision.child("proximity_properties") else { continue };
        for key in ["mu_static", "mu_dynamic"] {
            texts.extend(properties.child(key).and_then(value).map(|text| (key, text)));
        }
    }
    for (key, text) in &texts {
        match text.parse::<f64>() {
            Ok(mu) if FRICTIONS.contains(&mu) => {
                blueprint.friction = Some(blueprint.friction.map_or(mu, |known| known.min(mu)));
            }
            _ => blueprint.warnings.push(format!(
                "link \"{link}\": its {key} \"{}\" is not between {} and {}, and was left out",
                text.chars().take(40).collect::<String>(),
                FRICTIONS.start(),
                FRICTIONS.end()
            )),
        }
    }
}

/// The first `<origin>` of an element; no origin is the identity.
fn origin_of(element: &Element, owner: &str) -> Result<Pose, String> {
    let Some(origin) = element.child("origin") else { return Ok(Pose::IDENTITY) };
    let vector = |key: &str| origin.attribute(key).map_or(Some([0.0; 3]), numbers).map(DVec3::from_array);
    match (vector("xyz"), vector("rpy")) {
        (Some(xyz), Some(rpy)) if xyz.is_finite() && rpy.is_finite() => Ok(Pose::from_xyz_rpy(xyz, rpy)),
        _ => {
            let texts = ["xyz", "rpy"].map(|key| origin.attribute(key).unwrap_or_default());
            Err(format!("an origin of \"{owner}\" is not three finite numbers{}", decimal_comma(&texts.join(" "))))
        }
    }
}

/// Colour of a material; grey where its `<color>` has no usable numbers.
fn colour_of(material: &Element) -> Option<Rgb> {
    let rgba = material.child("color")?.attribute("rgba").unwrap_or_default();
    let channels: Vec<f32> = rgba.split([',', ';', ' ', '\t', '\n', '\r']).filter_map(|c| c.parse().ok()).collect();
    Some(Rgb::from_unit(channels.first_chunk::<3>().copied().unwrap_or([0.7; 3])))
}

/// Visual or collision elements of a link, each with its shape.
fn shape_tags<'a>(
    link: &str,
    element: &'a Element,
    kind: &str,
    warnings: &mut Vec<String>,
) -> Vec<(&'a Element, &'a Element)> {
    let known = |shape: &&Element| ["box", "cylinder", "sphere", "capsule", "mesh"].contains(&shape.name.as_str());
    let declared = element.children.iter().filter(|child| child.name == kind);
    declared
        .filter_map(|declared| {
            let shapes = &declared.child("geometry")?.children;
            if let Some(unknown) = shapes.iter().find(|shape| !known(shape)) {
                warnings.push(format!("link \"{link}\": the shape <{}> is not known and was left out", unknown.name));
            }
            Some((declared, shapes.iter().find(known)?))
        })
        .collect()
}

fn shape_of(shape: &Element, link: &str, read_mesh: MeshReader<'_>) -> Result<ShapeSource, ObjectError> {
    let bad = |cause: String| ObjectError(format!("link \"{link}\": {cause}"));
    let positive = |value: f64, what: &str| {
        let possible = value.is_finite() && value > 0.0;
        if possible { Ok(value) } else { Err(bad(format!("{what} = {value} is not a positive length"))) }
    };
    let missing = |key: &str| bad(format!("its {} has no {key}", shape.name));
    let length = |key: &str| {
        let text = shape.attribute(key).ok_or_else(|| missing(key))?;
        let value = text.trim().parse();
        value.map_or_else(
            |_no_number| Err(bad(format!("the {key} of its {} is not a number{}", shape.name, instead(text)))),
            |value| positive(value, key),
        )
    };
    let primitive = match shape.name.as_str() {
        "box" => {
            let text = shape.attribute("size").ok_or_else(|| missing("size"))?;
            let none = || bad(format!("the size of its box is not three numbers{}", instead(text)));
            let [x, y, z] = numbers(text).ok_or_else(none)?;
            let size = DVec3::new(positive(x, "size")?, positive(y, "size")?, positive(z, "size")?);
            Primitive::Cuboid { half: 0.5 * size }
        }
        "cylinder" => Primitive::Cylinder { radius: length("radius")?, half_length: 0.5 * length("length")? },
        "capsule" => Primitive::Capsule { radius: length("radius")?, half_length: 0.5 * length("length")? },
        "sphere" => Primitive::Sphere { radius: length("radius")? },
        _ => {
            let scale = shape
                .attribute("scale")
                .map_or(Some([1.0; 3]), |text| numbers(text).or_else(|| numbers(text).map(|[factor]| [factor; 3])));
            let factors = scale.map_or(DVec3::NAN, DVec3::from_array);
            if !factors.is_finite() || factors.min_element() == 0.0 || factors.abs().max_element() > 1e9 {
                return Err(bad(format!("the mesh scale {factors} is not usable")));
            }
            let file = shape.attribute("filename").ok_or_else(|| bad("its mesh names no file".to_owned()))?;
            let mut parts = read_mesh(file)?;
            for part in &mut parts {
                part.mesh.scale(factors);
            }
            return Ok(ShapeSource::Mesh(parts));
        }
    };
    Ok(ShapeSource::Primitive(primitive))
}

/// Mass properties as a link declares them, about their own origin, and the pose of that origin in the link. Terms that
/// are missing or no numbers count as zero.
fn inertial_of(
    link: &str,
    element: &Element,
    warnings: &mut Vec<String>,
) -> Result<Option<(MassProperties, Pose)>, String> {
    let Some(inertial) = element.child("inertial") else { return Ok(None) };
    let mass = inertial.child("mass").and_then(|mass| mass.attribute("value"));
    if let Some(text) = mass.filter(|text| text.trim().parse::<f64>().is_err()) {
        let shown: String = text.chars().take(40).collect();
        warnings.push(format!("link \"{link}\": its mass \"{shown}\" is not a number{}", decimal_comma(text)));
    }
    let term = |part: &str, key: &str| {
        let text = inertial.child(part).and_then(|part| part.attribute(key));
        text.and_then(|text| text.trim().parse().ok()).unwrap_or(0.0)
    };
    let [ixx, ixy, ixz, iyy, iyz, izz] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"].map(|key| term("inertia", key));
    let inertia = DMat3::from_cols(DVec3::new(ixx, ixy, ixz), DVec3::new(ixy, iyy, iyz), DVec3::new(ixz, iyz, izz));
    let own = MassProperties { mass: term("mass", "value"), centre: DVec3::ZERO, inertia };
    Ok(Some((own, origin_of(inertial, link)?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blueprint(text: &str) -> Result<Blueprint, ObjectError> {
        parse("thing", text.as_bytes(), &|name| Err(MeshFileError::unreadable(name, "no meshes here")))
    }

    #[test]
    fn hand_written_files_are_read_with_warnings() {
        let sloppy = "\u{feff}\n\n<?xml version='1.0' encoding='latin1'?>\n<!-- a mug -->\n\
            <robot xmlns:x='http://x' name='mug'><gazebo><deep><deeper/></deep></gazebo>\n\
            <link name='body' type='odd'><visual name='v'><geometry><box size='1,2,3'/></geometry>\
            <material><color rgba='1 0 0'/></material></visual>\
            <collision><geometry><heightmap/></geometry></collision>\
            <inertial><mass value='0.2'/></inertial></link>\
            <link/><joint name='j' type='revolute'><axis xyz='0 0 1'/><parent link='body'/><child link='link_1'/>\
            <limit/></joint><joint name='lost'/></robot>";
        let read = blueprint(sloppy).expect("tolerated");
        assert_eq!((read.visual.len(), read.collision.len(), read.inertials.len()), (1, 0, 1));
        assert_eq!(read.visual[0].colour, Some(Rgb(255, 0, 0)));
        let mass = read.inertials[0].declared.expect("declared").mass;
        assert!((mass - 0.2).abs() < 1e-12);
        assert_eq!(read.warnings.len(), 3, "{:?}", read.warnings);
    }

    #[test]
    fn the_modulus_of_a_soft_object_is_drakes() {
        let of = |values: [&str; 2]| {
            let collision = values.map(|value| {
                format!(
                    "<collision><geometry><sphere radius='0.02'/></geometry><drake:proximity_properties>\
                     <drake:hydroelastic_modulus value='{value}'/></drake:proximity_properties></collision>"
                )
            });
            let text = format!("<robot xmlns:drake='http://d'><link name='a'>{}</link></robot>", collision.concat());
            let read = blueprint(&text).expect("a URDF");
            (read.modulus, read.warnings.len())
        };
        assert_eq!(of(["5e4", "2e4"]), (Some(2e4), 0), "the softer of two");
        assert_eq!(of(["-1", "nan"]), (None, 2));
        assert_eq!(blueprint("<robot><link name='a'/></robot>").expect("a URDF").modulus, None);
    }

    #[test]
    fn friction_is_read_in_three_dialects() {
        let of = |inside: &str, beside: &str, near: &str| {
            let shape = "<geometry><sphere radius='0.02'/></geometry>";
            let text = format!(
                "<robot xmlns:drake='http://d'><link name='a'>{inside}<collision>{shape}{beside}</collision></link>{near}</robot>"
            );
            let read = blueprint(&text).expect("a URDF");
            (read.friction, read.warnings.len())
        };
        assert_eq!(of("<contact><lateral_friction value='0.05'/></contact>", "", ""), (Some(0.05), 0));
        assert_eq!(of("", "", "<gazebo reference='a'><mu1>0.3</mu1><mu2> 0.2 </mu2></gazebo>"), (Some(0.2), 0));
        assert_eq!(of("", "", "<gazebo reference='b'><mu1>0.3</mu1></gazebo>"), (None, 0));
        let drake = |value: &str| {
            format!("<drake:proximity_properties><drake:mu_static value='{value}'/></drake:proximity_properties>")
        };
        assert_eq!(of("", &drake("0.4"), ""), (Some(0.4), 0));
        assert_eq!(of("", &drake("-1"), ""), (None, 1));
    }

    #[test]
    fn joints_stand_where_their_limits_and_followers_say() {
        let of = |limit: &str, mimic: &str| {
            let link = |name: &str| {
                format!(
                    "<link name='{name}'><collision><geometry><sphere radius='0.02'/></geometry></collision></link>"
                )
            };
            let joint = |name: &str, child: &str, more: &str| {
                format!(
                    "<joint name='{name}' type='prismatic'><axis xyz='0 0 2'/><parent link='a'/><child link='{child}'/>{more}</joint>"
                )
            };
            let parts = [link("a"), link("b"), link("c"), joint("j", "b", limit), joint("k", "c", mimic)];
            let read = blueprint(&format!("<robot>{}</robot>", parts.concat())).expect("a URDF");
            let heights = read.collision.iter().map(|solid| match solid {
                palpate_geometry::SolidPart::Primitive(_, pose) => pose.position.z,
                palpate_geometry::SolidPart::Mesh(_) => f64::NAN,
            });
            heights.skip(1).collect::<Vec<_>>()
        };
        assert_eq!(of("<limit lower='-1' upper='1'/>", ""), [0.0, 0.0]);
        let limit = "<limit lower='0.004' upper='0.01'/>";
        assert_eq!(of(limit, "<mimic joint='j' multiplier='-1' offset='0.006'/>"), [0.004, 0.002]);
        assert_eq!(
            of("<limit lower='-0.01' upper='-0.004'/>", "<mimic joint='gone' offset='0.003'/>"),
            [-0.004, 0.003]
        );
    }

    #[test]
    fn other_encodings_are_read_and_decimal_commas_are_named() {
        let text =
            "<robot><link name='kör'><visual><geometry><box size='0.01 0.02 0.03'/></geometry></visual></link></robot>";
        let read = |bytes: &[u8]| parse("thing", bytes, &|name| Err(MeshFileError::unreadable(name, "none")));
        let wide: Vec<u16> = std::iter::once(0xFEFF).chain(text.encode_utf16()).collect();
        let little: Vec<u8> = wide.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big: Vec<u8> = wide.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
        for bytes in [little, big, latin] {
            assert_eq!(read(&bytes).expect("read").visual.len(), 1);
        }
        let refused = |text: &str| read(text.as_bytes()).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(refused(&text.replace('.', ",")).contains("\"0,01 0,02 0,03\" has decimal commas"));
        let twice = "<robot><link name='a'/><link name='a'/></robot>";
        assert!(refused(twice).contains("two links are called \"a\""));
        assert!(refused("version https://git-lfs.github.com/spec/v1").contains("git lfs pull"));
    }

    #[test]
    fn files_that_are_no_urdf_are_refused_with_the_reason() {
        let message = |text: &str| blueprint(text).map(|_| ()).expect_err("refused").to_string();
        assert!(message("").contains("the file is empty"));
        assert!(message("<sdf/>").contains("SDF"));
        assert!(message("<robot><link name='${x}'/></robot>").contains("xacro"));
        assert!(message("<robot><link></robot>").contains("well-formed"));
        assert!(message("<robot><link>").contains("cut short"));
        assert!(message(&"<robot>".repeat(10_000)).contains("nested"));
        assert!(message("<html></html>").contains("web page") && message("<svg/>").contains("<svg>"));
    }

    #[test]
    fn shapes_without_their_numbers_are_refused_by_name() {
        let message = |shape: &str| {
            let text =
                format!("<robot><link name='a'><collision><geometry>{shape}</geometry></collision></link></robot>");
            blueprint(&text).map(|_| ()).expect_err("refused").to_string()
        };
        assert!(message("<box/>").contains("size") && message("<box size='1 2'/>").contains("size"));
        assert!(message("<cylinder radius='0.01'/>").contains("length"));
        assert!(message("<mesh/>").contains("mesh") && message("<mesh filename='a.obj' scale='x'/>").contains("scale"));
    }
}
