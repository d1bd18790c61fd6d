//! Exchange of left and right: the gripper is symmetric, so a mirrored grasp is another training example.

/// For each channel, the index of its counterpart on the other finger (`.._left..` and `.._right..`), or its own where its name
/// has no side, as the pressure in the chambers. `None` where one has a side and no counterpart, or none has a side.
pub fn mirror(channels: &[String]) -> Option<Vec<usize>> {
    let other = |(at, name): (usize, &String)| {
        let swapped = if name.contains("left") { name.replace("left", "right") } else { name.replace("right", "left") };
        if swapped == *name { Some(at) } else { channels.iter().position(|own| *own == swapped) }
    };
    let counterparts: Vec<usize> = channels.iter().enumerate().map(other).collect::<Option<_>>()?;
    counterparts.iter().enumerate().any(|(own, other)| own != *other).then_some(counterparts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_paired_by_finger() {
        let names = |list: &[&str]| list.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        assert_eq!(mirror(&names(&["bend_left", "bend_right", "grip_right", "grip_left"])), Some(vec![1, 0, 3, 2]));
        assert_eq!(mirror(&names(&["bend_left", "line", "bend_right"])), Some(vec![2, 1, 0]));
        assert_eq!(mirror(&names(&["bend_left", "grip"])), None);
        assert_eq!(mirror(&names(&["thumb", "wrist"])), None);
    }
}
