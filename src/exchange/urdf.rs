//! The gripper as URDF, for viewers of ROS: a chain of boxes per finger, with the joints that the messages name.

use crate::content::{joint_name, segment_name};
use palpate_sim::gripper::{GripperModel, Side};
use std::f64::consts::PI;
use std::fmt::Write as _;

/// URDF of a gripper. Its root is the link `palm`; segments have z towards the tip and x out of the pad.
pub(crate) fn gripper_urdf(gripper: &GripperModel) -> String {
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
    text.push_str("</robot>\n");
    text
}

/// Height of the box that stands for the palm (m).
const PALM: f64 = 0.02;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_joint_has_its_links() {
        let gripper = GripperModel::default();
        let urdf = gripper_urdf(&gripper);
        assert_eq!(urdf.matches("<link ").count(), 1 + 2 * (gripper.finger.joints + 1));
        assert_eq!(urdf.matches("type=\"revolute\"").count(), 2 * gripper.finger.joints);
        for part in urdf.split("link=\"").skip(1) {
            let name = part.split('"').next().expect("a name");
            assert!(urdf.contains(&format!("<link name=\"{name}\">")), "{name}");
        }
    }
}
