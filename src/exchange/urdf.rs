//! The gripper as URDF, for viewers of ROS: a chain of boxes per finger, with the joints that the messages name, and the
//! object that floats between them.

use crate::content::{joint_name, segment_name};
use palpate_geometry::SurfaceMesh;
use palpate_sim::gripper::{GripperModel, Side};
use std::f64::consts::PI;
use std::fmt::Write as _;

/// URDF of a gripper. Its root is the link `palm`; segments have z towards the tip and x out of the pad. A mesh is that of
/// the link `object`.
pub(crate) fn gripper_urdf(gripper: &GripperModel, object: Option<&SurfaceMesh>) -> String {
    let finger = &gripper.finger;
    let lengths: Vec<f64> = finger.segment_lengths().collect();
    let (pad, back, width) = (gripper.pad.thickness, finger.back, finger.width);
    let mut text = String::from("<?xml version=\"1.0\"?>\n<robot name=\"palpate_gripper\">\n");
    let mut link = |name: &str, size: [f64; 3], at: [f64; 3]| {
        let [[a, b, c], [x, y, z]] = [size, at];
        // Writing to a text cannot fail.
        let _written = writeln!(
            text,
            "  <link name=\"{name}\">\n    <visual>\n      <origin xyz=\"{x} {y} {z}\" rpy=\"0 0 0\"/>\n      <geometry><box \
             size=\"{a} {b} {c}\"/></geometry>\n    </visual>\n  </link>"
        );
    };
    link("palm", [2.0 * (gripper.half_gap() + back), 1.5 * width, PALM], [0.0, 0.0, 0.5 * PALM]);
    for side in Side::BOTH {
        for (segment, length) in lengths.iter().enumerate() {
            link(&segment_name(side, segment), [pad + back, width, *length], [0.5 * (pad - back), 0.0, 0.5 * length]);
        }
    }
    for side in Side::BOTH {
        let sign = side.closing_sign();
        let turned = if sign > 0.0 { format!("{PI} 0 0") } else { format!("0 {PI} 0") };
        let (root, x) = (segment_name(side, 0), -sign * gripper.half_gap());
        let _written = writeln!(
            text,
            "  <joint name=\"{}_root\" type=\"fixed\">\n    <parent link=\"palm\"/>\n    <child link=\"{root}\"/>\n    <origin \
             xyz=\"{x} 0 0\" rpy=\"{turned}\"/>\n  </joint>",
            side.name()
        );
        for joint in 1..=finger.joints {
            let limit = finger.curvature_limit * finger.segment_length();
            let [parent, child] = [joint - 1, joint].map(|segment| segment_name(side, segment));
            let _written = writeln!(
                text,
                "  <joint name=\"{}\" type=\"revolute\">\n    <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>\n    \
                 <origin xyz=\"0 0 {}\" rpy=\"0 0 0\"/>\n    <axis xyz=\"0 1 0\"/>\n    <limit lower=\"{}\" upper=\"{limit}\" \
                 effort=\"1\" velocity=\"10\"/>\n  </joint>",
                joint_name(side, joint),
                lengths[joint - 1],
                -limit
            );
        }
    }
    if let Some(mesh) = object {
        // No file lies beside the message: the mesh is in the text.
        let _written = writeln!(
            text,
            "  <link name=\"object\">\n    <visual>\n      <geometry><mesh filename=\"data:model/stl;base64,{}\"/></geometry>\n    \
             </visual>\n  </link>\n  <joint name=\"object\" type=\"floating\">\n    <parent link=\"palm\"/>\n    <child \
             link=\"object\"/>\n  </joint>",
            base64(&stl(mesh))
        );
    }
    text.push_str("</robot>\n");
    text
}

/// A mesh as binary STL: a head of 80 bytes, the number of triangles, then for each its normal (zero: that of its corners),
/// its corners, and two bytes.
fn stl(mesh: &SurfaceMesh) -> Vec<u8> {
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    let mut bytes = vec![0; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        let corners = triangle.map(|corner| mesh.vertices[corner as usize].position);
        bytes.extend([[0.0; 3]].iter().chain(&corners).flatten().flat_map(|number: &f32| number.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// Bytes as text (RFC 4648, chapter 4).
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let quartet = |bytes: &[u8]| {
        let number = (0..3).fold(0, |number, k| number << 8 | usize::from(bytes.get(k).copied().unwrap_or(0)));
        let letter = |k: usize| if k <= bytes.len() { LETTERS[number >> (18 - 6 * k) & 63] } else { b'=' };
        (0..4).map(|k| char::from(letter(k))).collect::<Vec<_>>()
    };
    bytes.chunks(3).flat_map(quartet).collect()
}

/// Height of the box that stands for the palm (m).
const PALM: f64 = 0.02;

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::palette::Rgb;
    use palpate_geometry::{Finish, Primitive};

    #[test]
    fn every_joint_has_its_links() {
        let gripper = GripperModel::default();
        let mut mesh = SurfaceMesh::default();
        mesh.add(&Primitive::Sphere { radius: 0.02 }.tessellate(), Rgb(9, 9, 9), Finish::Matt);
        let urdf = gripper_urdf(&gripper, Some(&mesh));
        assert_eq!(urdf.matches("<link ").count(), 2 + 2 * (gripper.finger.joints + 1));
        assert_eq!(stl(&mesh).len(), 84 + 50 * mesh.indices.len() / 3);
        assert_eq!(urdf.matches("type=\"revolute\"").count(), 2 * gripper.finger.joints);
        for part in urdf.split("link=\"").skip(1) {
            let name = part.split('"').next().expect("a name");
            assert!(urdf.contains(&format!("<link name=\"{name}\">")), "{name}");
        }
    }

    #[test]
    fn bytes_become_text_as_in_the_standard() {
        for (bytes, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg==")] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
        assert_eq!(base64(&[0xfb, 0xff]), "+/8=");
    }
}
