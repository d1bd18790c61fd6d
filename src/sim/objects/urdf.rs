//! URDF files: every link's shapes and masses, gathered in the frame of the root link. Fixed joints weld; movable
//! ones are welded at zero, with a warning, since a grasped object is one rigid body here.

use super::ObjectError;
use super::assemble::{Blueprint, Inertial, ShapeSource};
use super::urdf_text;
use glam::{DMat3, DVec3};
use palpate_geometry::palette::Rgb;
use palpate_geometry::{ColouredPart, MassProperties, MeshFileError, Pose, Primitive};
use std::collections::HashMap;

/// Reads meshes by the reference that the URDF makes to them.
pub(super) type MeshReader<'a> = &'a dyn Fn(&str) -> Result<Vec<ColouredPart>, MeshFileError>;

/// Parses the bytes of a URDF.
pub(super) fn parse(name: &str, bytes: &[u8], read_mesh: MeshReader<'_>) -> Result<Blueprint, ObjectError> {
    let malformed = |cause: String| ObjectError::Malformed { name: name.to_owned(), cause };
    let clean = urdf_text::clean(bytes).map_err(malformed)?;
    let robot = urdf_rs::read_from_string(&clean.text)
        .map_err(|e| malformed(e.to_string().trim_start_matches("custom: ").to_owned()))?;
    let mut blueprint = Blueprint::new(name);
    blueprint.warnings = clean.warnings;
    let poses = link_poses(&robot, &mut blueprint.warnings).map_err(malformed)?;
    let colours: HashMap<&str, Rgb> =
        robot.materials.iter().filter_map(|m| Some((m.name.as_str(), colour_of(m)?))).collect();
    for link in &robot.links {
        let Some(root_from_link) = poses.get(link.name.as_str()) else {
            continue;
        };
        for visual in &link.visual {
            let material = visual.material.as_ref();
            let colour = material.and_then(|m| colour_of(m).or_else(|| colours.get(m.name.as_str()).copied()));
            let place = *root_from_link * pose_of(&visual.origin, &link.name).map_err(malformed)?;
            let shape = shape_of(&visual.geometry, &link.name, read_mesh);
            match shape {
                Ok(shape) => blueprint.add_visual(&shape, &place, colour),
                // A visual that is missing is drawn as what is touched instead.
                Err(error) if !link.collision.is_empty() => blueprint.warnings.push(error.to_string()),
                Err(error) => return Err(error),
            }
        }
        for collision in &link.collision {
            let place = *root_from_link * pose_of(&collision.origin, &link.name).map_err(malformed)?;
            let shape = shape_of(&collision.geometry, &link.name, read_mesh)?;
            blueprint.add_collision(&shape, &place);
        }
        let has_shape = !(link.visual.is_empty() && link.collision.is_empty());
        if has_shape || link.inertial.mass.value != 0.0 {
            let declared = inertial_of(link, root_from_link).map_err(malformed)?;
            blueprint.inertials.push(Inertial { link: link.name.clone(), declared });
        }
    }
    Ok(blueprint)
}

/// Where each link lies in the frame of the root. Loops and second parents are refused.
fn link_poses<'a>(robot: &'a urdf_rs::Robot, warnings: &mut Vec<String>) -> Result<HashMap<&'a str, Pose>, String> {
    let mut parent_of: HashMap<&str, &urdf_rs::Joint> = HashMap::new();
    let known = |name: &str| robot.links.iter().any(|link| link.name == name);
    for joint in &robot.joints {
        for end in [&joint.parent.link, &joint.child.link] {
            if !known(end) {
                return Err(format!("joint \"{}\" refers to a link \"{end}\" that does not exist", joint.name));
            }
        }
        if let Some(other) = parent_of.insert(&joint.child.link, joint) {
            let child = &joint.child.link;
            return Err(format!("link \"{child}\" hangs from two joints, \"{}\" and \"{}\"", other.name, joint.name));
        }
    }
    let roots: Vec<&str> =
        robot.links.iter().map(|l| l.name.as_str()).filter(|name| !parent_of.contains_key(name)).collect();
    let Some(root) = roots.first() else {
        return Err(if robot.links.is_empty() {
            "it has no links".to_owned()
        } else {
            "its joints form a loop: no link is the root".to_owned()
        });
    };
    for other in &roots[1..] {
        warnings.push(format!("link \"{other}\" is not joined to \"{root}\"; it is kept where it is"));
    }
    let mut poses: HashMap<&str, Pose> = roots.iter().map(|name| (*name, Pose::IDENTITY)).collect();
    for link in &robot.links {
        // Up to the nearest link already placed, then back down.
        let mut chain: Vec<&urdf_rs::Joint> = Vec::new();
        let mut at = link.name.as_str();
        while !poses.contains_key(at) {
            let Some(joint) = parent_of.get(at) else { break };
            if chain.len() > robot.links.len() {
                return Err(format!("the joints around link \"{at}\" form a loop"));
            }
            chain.push(joint);
            at = &joint.parent.link;
        }
        for joint in chain.into_iter().rev() {
            let parent = poses[joint.parent.link.as_str()];
            let place = parent * pose_of(&joint.origin, &joint.name)?;
            poses.insert(&joint.child.link, place);
        }
    }
    Ok(poses)
}

fn pose_of(origin: &urdf_rs::Pose, owner: &str) -> Result<Pose, String> {
    let (xyz, rpy) = (DVec3::from_array(*origin.xyz), DVec3::from_array(*origin.rpy));
    if xyz.is_finite() && rpy.is_finite() {
        Ok(Pose::from_xyz_rpy(xyz, rpy))
    } else {
        Err(format!("an origin of \"{owner}\" is not a finite number"))
    }
}

fn colour_of(material: &urdf_rs::Material) -> Option<Rgb> {
    material.color.as_ref().map(|c| Rgb::from_unit([c.rgba[0], c.rgba[1], c.rgba[2]].map(|x| x as f32)))
}

fn shape_of(geometry: &urdf_rs::Geometry, link: &str, read_mesh: MeshReader<'_>) -> Result<ShapeSource, ObjectError> {
    let positive = |value: f64, what: &str| {
        if value.is_finite() && value > 0.0 {
            Ok(value)
        } else {
            let cause = format!("{what} = {value} is not a positive length");
            Err(ObjectError::BadShape { link: link.to_owned(), cause })
        }
    };
    let primitive = match geometry {
        urdf_rs::Geometry::Box { size } => {
            let half = DVec3::new(positive(size[0], "size")?, positive(size[1], "size")?, positive(size[2], "size")?);
            Primitive::Cuboid { half: 0.5 * half }
        }
        urdf_rs::Geometry::Cylinder { radius, length } => Primitive::Cylinder {
            radius: positive(*radius, "radius")?,
            half_length: 0.5 * positive(*length, "length")?,
        },
        urdf_rs::Geometry::Capsule { radius, length } => {
            Primitive::Capsule { radius: positive(*radius, "radius")?, half_length: 0.5 * positive(*length, "length")? }
        }
        urdf_rs::Geometry::Sphere { radius } => Primitive::Sphere { radius: positive(*radius, "radius")? },
        urdf_rs::Geometry::Mesh { filename, scale } => {
            let factors = scale.map_or(DVec3::ONE, |s| DVec3::from_array(*s));
            if !factors.is_finite() || factors.min_element() == 0.0 || factors.abs().max_element() > 1e9 {
                let cause = format!("the mesh scale {factors} is not usable");
                return Err(ObjectError::BadShape { link: link.to_owned(), cause });
            }
            let mut parts = read_mesh(filename).map_err(|cause| ObjectError::Mesh { cause })?;
            for part in &mut parts {
                part.mesh.scale(factors);
            }
            return Ok(ShapeSource::Mesh(parts));
        }
    };
    Ok(ShapeSource::Primitive(primitive))
}

/// What the file says a link weighs, in the root frame, where that is possible for a real body.
fn inertial_of(link: &urdf_rs::Link, root_from_link: &Pose) -> Result<Option<MassProperties>, String> {
    let inertial = &link.inertial;
    let i = &inertial.inertia;
    let place = *root_from_link * pose_of(&inertial.origin, &link.name)?;
    let own = MassProperties {
        mass: inertial.mass.value,
        centre: DVec3::ZERO,
        inertia: DMat3::from_cols(
            DVec3::new(i.ixx, i.ixy, i.ixz),
            DVec3::new(i.ixy, i.iyy, i.iyz),
            DVec3::new(i.ixz, i.iyz, i.izz),
        ),
    };
    let sound_mass = own.mass.is_finite() && own.mass > 0.0 && own.mass < 1e4;
    Ok(sound_mass.then(|| own.seen_from(&place)))
}
