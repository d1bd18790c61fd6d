//! Files as other people write them: several links, scaled meshes, primitives, package paths, sloppy XML, non-convex
//! shapes of thousands of triangles.

use super::obj_text;
use crate::program::run;
use glam::{DQuat, DVec2, DVec3};
use palpate_geometry::{Pose, Primitive, TriMesh, lathe};
use palpate_lab::grasping::{GraspSummary, grasp};
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::Scene;
use std::fmt::Write as _;
use std::path::Path;

/// Loads a file and grasps what it holds, fixed and free.
fn grasped(path: &Path) -> ObjectModel {
    let mut scene = Scene::default();
    path.to_str().unwrap().clone_into(&mut scene.object.source);
    let object = scene.load_object().unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    for fixed in [false, true] {
        scene.object.fixed = fixed;
        let summary = GraspSummary::new(&grasp(&scene, object.as_ref(), 0), &scene);
        let what = path.display();
        assert!(summary.finite && summary.converged, "{what}, fixed {fixed}: {:?}", summary.quality);
        assert!(summary.contact_onset_s.is_some(), "{what}, fixed {fixed}: never touched");
        let hold = summary.hold.expect("the default programme holds");
        assert!(hold.force_n.iter().all(|f| *f > 0.02), "{what}, fixed {fixed}: {:?}", hold.force_n);
    }
    object.expect("not an empty hand")
}

/// A ring lying flat (m).
fn torus(ring: f64, tube: f64, around: usize, across: usize) -> TriMesh {
    let angle = |k: usize, of: usize| std::f64::consts::TAU * k as f64 / of as f64;
    let point = |i: usize, j: usize| {
        let (a, b) = (angle(i, around), angle(j, across));
        let r = ring + tube * b.cos();
        DVec3::new(r * a.cos(), r * a.sin(), tube * b.sin())
    };
    let index = |i: usize, j: usize| ((i % around) * across + j % across) as u32;
    let mut mesh = TriMesh::default();
    for i in 0..around {
        for j in 0..across {
            mesh.points.push(point(i, j));
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// A binary STL, in millimetres as CAD programs write it.
fn stl_in_millimetres(mesh: &TriMesh) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for triangle in &mesh.triangles {
        bytes.extend([0; 12]);
        for corner in mesh.corners(*triangle) {
            for value in (corner * 1e3).to_array() {
                bytes.extend((value as f32).to_le_bytes());
            }
        }
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn primitives_on_several_links_are_welded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dumbbell.urdf");
    let text = r#"<?xml version="1.0"?>
        <robot name="dumbbell">
          <material name="steel"><color rgba="0.6 0.6 0.65 1"/></material>
          <link name="bar">
            <inertial><mass value="0.05"/><inertia ixx="1e-5" ixy="0" ixz="0" iyy="2e-6" iyz="0" izz="1e-5"/></inertial>
            <visual><origin rpy="1.5708 0 0"/><geometry><cylinder radius="0.012" length="0.05"/></geometry>
              <material name="steel"/></visual>
            <collision><origin rpy="1.5708 0 0"/><geometry><cylinder radius="0.012" length="0.05"/></geometry></collision>
          </link>
          <link name="left"><inertial><mass value="0.1"/>
              <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial>
            <collision><geometry><sphere radius="0.02"/></geometry></collision></link>
          <link name="right"><inertial><mass value="0.1"/>
              <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial>
            <collision><geometry><box size="0.036 0.03 0.036"/></geometry></collision></link>
          <joint name="l" type="fixed"><parent link="bar"/><child link="left"/><origin xyz="0 0.03 0"/></joint>
          <joint name="r" type="fixed"><parent link="bar"/><child link="right"/><origin xyz="0 -0.03 0"/></joint>
        </robot>"#;
    std::fs::write(&path, text).unwrap();
    let object = grasped(&path);
    assert!((object.mass.mass - 0.25).abs() < 1e-12, "{}", object.mass.mass);
    let size = object.bounds.size();
    assert!((size.y - 0.095).abs() < 1e-3 && (size.x - 0.04).abs() < 1e-3, "{size}");
}

#[test]
fn meshes_are_scaled_placed_and_found_through_packages() {
    let folder = tempfile::tempdir().unwrap();
    let package = folder.path().join("kitchen_description");
    for below in ["urdf", "meshes/visual"] {
        std::fs::create_dir_all(package.join(below)).unwrap();
    }
    std::fs::write(package.join("package.xml"), "<package><name>kitchen_description</name></package>").unwrap();
    let profile = [[0.0, -0.03], [0.021, -0.03], [0.025, 0.0], [0.028, 0.03], [0.0, 0.03]];
    let cup = lathe(&profile.map(DVec2::from_array));
    std::fs::write(package.join("meshes/visual/cup.stl"), stl_in_millimetres(&cup)).unwrap();
    // Tabs, a byte-order mark, attributes in odd order, exponents, a comment before the header, an unknown tag.
    let text = "\u{feff}<!-- exported -->\n<robot name='cup'>\n\t<link name='base_link'>\n\
        \t\t<visual><geometry><mesh scale='1e-3 .001 0.001' filename='package://kitchen_description/meshes/visual/cup.stl'/>\
        </geometry><origin rpy='0 0 0' xyz='0 0 0.03'/></visual>\n\
        \t\t<collision><geometry><mesh filename='package://kitchen_description/meshes/visual/cup.stl' scale='0.001 0.001 0.001'/>\
        </geometry><origin xyz='0 0 0.03'/></collision>\n\
        \t\t<inertial><mass value='0.12'/></inertial>\n\t</link>\n\t<gazebo reference='base_link'/>\n</robot>";
    let path = package.join("urdf/cup.urdf");
    std::fs::write(&path, text).unwrap();
    let object = grasped(&path);
    let size = object.bounds.size();
    assert!((size - DVec3::new(0.056, 0.056, 0.06)).abs().max_element() < 5e-4, "{size}");
    assert!((object.mass.mass - 0.12).abs() < 1e-12);
}

#[test]
fn a_ring_of_thousands_of_triangles_keeps_its_hole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ring.obj");
    let mut mesh = torus(0.024, 0.008, 96, 48);
    // Standing on its rim, so that the fingers meet the tube from both sides.
    mesh.transform(&Pose::new(DVec3::ZERO, DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2)));
    std::fs::write(&path, obj_text(&mesh)).unwrap();
    let object = grasped(&path);
    assert_eq!(object.surface.indices.len(), 96 * 48 * 2 * 3);
    // Away from the surface the baked distance is a lower bound of the true one.
    assert!(object.field.distance(DVec3::ZERO) > 0.008, "the hole is empty");
    let inside = object.field.distance(DVec3::new(0.024, 0.0, 0.0));
    assert!(inside < -0.003, "the tube is solid, not {inside}");
}

#[test]
fn a_lesson_whose_hand_stays_empty_says_so_and_names_a_command_that_works() {
    let folder = tempfile::tempdir().unwrap();
    // Lying flat, it slides down.
    std::fs::write(folder.path().join("ring.obj"), obj_text(&torus(0.03, 0.008, 48, 24))).unwrap();
    let ran = run(folder.path(), &["teach", "ring.obj", "--grasps", "10", "--out", "m.safetensors"]);
    assert!(ran.code == Some(0) && ran.err.contains("of 10 grasps: it slid away or was never touched"), "{ran:?}");
    let command = ran.out.lines().find_map(|line| line.trim().strip_prefix("palpate demo ")).unwrap();
    let arguments: Vec<&str> = std::iter::once("demo").chain(command.split(' ')).collect();
    let demo = run(folder.path(), &[&arguments[..], &["--grasps", "1", "--no-pictures"]].concat());
    assert!(demo.code == Some(0) && demo.out.contains("slipped out of the grasp"), "{demo:?}");
}

#[test]
fn millimetres_are_guessed_and_mentioned() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("knob.stl");
    let mesh = Primitive::Cylinder { radius: 0.018, half_length: 0.02 }.tessellate();
    std::fs::write(&path, stl_in_millimetres(&mesh)).unwrap();
    let object = grasped(&path);
    assert!((object.bounds.size().x - 0.036).abs() < 2e-4);
    assert!(object.warnings.iter().any(|w| w.contains("millimetre")), "{:?}", object.warnings);
}

#[test]
fn ascii_stl_with_inverted_faces_and_a_hole_is_mended() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block.stl");
    let mesh = Primitive::Sphere { radius: 0.02 }.tessellate();
    let mut text = String::from("solid block\n");
    for (k, triangle) in mesh.triangles.iter().enumerate().skip(1) {
        let mut corners = mesh.corners(*triangle);
        if k.is_multiple_of(2) {
            corners.swap(0, 1);
        }
        text.push_str(" facet normal 0 0 0\n  outer loop\n");
        for corner in corners {
            writeln!(text, "   vertex {} {} {}", corner.x, corner.y, corner.z).unwrap();
        }
        text.push_str("  endloop\n endfacet\n");
    }
    text.push_str("endsolid block\n");
    std::fs::write(&path, text).unwrap();
    let object = grasped(&path);
    assert!(object.warnings.len() >= 2, "winding and hole: {:?}", object.warnings);
}

#[test]
fn quads_groups_and_negative_indices_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("crate.obj");
    let mut text = String::from("# quads, counted backwards\r\ng crate\r\n");
    for z in [-0.02, 0.02] {
        for (x, y) in [(-0.015, -0.02), (0.015, -0.02), (0.015, 0.02), (-0.015, 0.02)] {
            write!(text, "v {x} {y} {z}\r\n").unwrap();
        }
    }
    for face in ["-8 -5 -6 -7", "-4 -3 -2 -1", "-8 -7 -3 -4", "-7 -6 -2 -3", "-6 -5 -1 -2", "-5 -8 -4 -1"] {
        write!(text, "f {face}\r\n").unwrap();
    }
    std::fs::write(&path, text).unwrap();
    let object = grasped(&path);
    assert!((object.bounds.size() - DVec3::new(0.03, 0.04, 0.04)).abs().max_element() < 1e-9);
    assert!(object.field.distance(DVec3::ZERO) < -0.009);
}
