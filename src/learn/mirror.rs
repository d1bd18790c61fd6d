//! Exchange of left and right: the gripper is symmetric, so a mirrored grasp is another training example.

/// For each channel, the index of its counterpart on the other finger (`.._left..` and `.._right..`); `None` unless
/// every channel has one.
pub fn mirror(channels: &[String]) -> Option<Vec<usize>> {
    let other = |name: &String| {
        let swapped = if name.contains("left") { name.replace("left", "right") } else { name.replace("right", "left") };
        channels.iter().position(|c| *c == swapped && swapped != *name)
    };
    channels.iter().map(other).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_paired_by_finger() {
        let names = |list: &[&str]| list.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        assert_eq!(mirror(&names(&["bend_left", "bend_right", "grip_right", "grip_left"])), Some(vec![1, 0, 3, 2]));
        assert_eq!(mirror(&names(&["bend_left", "grip"])), None);
    }
}
