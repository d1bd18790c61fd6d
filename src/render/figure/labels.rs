//! Places for labels beside points, so that they cover neither each other nor points.

/// A rectangle: lower and upper corner (points).
pub(super) type Box2 = [[f64; 2]; 2];

/// A label to be placed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    /// Point that it belongs to.
    pub(super) at: [f64; 2],
    /// Width and height of its text.
    pub(super) size: [f64; 2],
}

/// Distances of a label from its point (points); farther ones get a line to it.
const DISTANCES: [f64; 4] = [5.0, 12.0, 22.0, 36.0];
/// A label this near needs no line to its point (points).
pub(super) const NEAR: f64 = 9.0;
/// Directions from the point to the nearest edge of the label, best first.
const DIRECTIONS: [[f64; 2]; 8] =
    [[1.0, 0.0], [0.7, -0.7], [0.7, 0.7], [-1.0, 0.0], [0.0, -1.0], [0.0, 1.0], [-0.7, -0.7], [-0.7, 0.7]];

/// Place of each label, in order; `None` if it would cover another label or leave the room. If no place is free of
/// obstacles, the place that covers the least of them is taken, and nearer ones are preferred.
pub(super) fn place(wanted: &[Wanted], obstacles: &[Box2], room: Box2) -> Vec<Option<Box2>> {
    let mut placed: Vec<Option<Box2>> = Vec::new();
    for label in wanted {
        let candidates =
            DISTANCES.iter().flat_map(|distance| DIRECTIONS.map(|direction| boxed(label, direction, *distance)));
        let mut best: Option<(f64, Box2)> = None;
        for (rank, candidate) in candidates.enumerate() {
            if !inside(candidate, room) || placed.iter().flatten().any(|other| shared(candidate, *other) > 0.0) {
                continue;
            }
            let covered: f64 = obstacles.iter().map(|obstacle| shared(candidate, *obstacle)).sum();
            let score = covered + RANK * rank as f64;
            if best.is_none_or(|(least, _)| score < least) {
                best = Some((score, candidate));
            }
        }
        placed.push(best.map(|(_, place)| place));
    }
    placed
}

/// Cost of a later candidate, in covered square points.
const RANK: f64 = 0.6;

fn boxed(label: &Wanted, direction: [f64; 2], distance: f64) -> Box2 {
    let half = label.size.map(|side| side / 2.0);
    let centre = [0, 1].map(|k| {
        let beside = if direction[k].abs() > 0.5 { direction[k].signum() * half[k] } else { 0.0 };
        label.at[k] + direction[k] * distance + beside
    });
    [[centre[0] - half[0], centre[1] - half[1]], [centre[0] + half[0], centre[1] + half[1]]]
}

fn inside(inner: Box2, outer: Box2) -> bool {
    (0..2).all(|k| inner[0][k] >= outer[0][k] && inner[1][k] <= outer[1][k])
}

/// Area that two rectangles share.
fn shared(a: Box2, b: Box2) -> f64 {
    let side = |k: usize| (a[1][k].min(b[1][k]) - a[0][k].max(b[0][k])).max(0.0);
    side(0) * side(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: Box2 = [[0.0, 0.0], [200.0, 200.0]];

    #[test]
    fn labels_never_cover_each_other_and_avoid_points() {
        let near = |n: f64| Wanted { at: [100.0 + 3.0 * n, 100.0 + 2.0 * n], size: [40.0, 10.0] };
        let wanted: Vec<Wanted> = (0..6).map(|n| near(f64::from(n))).collect();
        let points: Vec<Box2> = wanted.iter().map(|w| [w.at.map(|c| c - 3.0), w.at.map(|c| c + 3.0)]).collect();
        let placed = place(&wanted, &points, ROOM);
        let found: Vec<Box2> = placed.iter().flatten().copied().collect();
        assert!(found.len() >= 5, "{placed:?}");
        for (n, one) in found.iter().enumerate() {
            assert!(inside(*one, ROOM));
            assert!(points.iter().all(|point| shared(*one, *point) == 0.0), "{one:?}");
            assert!(found[..n].iter().all(|other| shared(*one, *other) == 0.0), "{found:?}");
        }
    }

    #[test]
    fn a_label_at_the_right_edge_goes_to_the_left_and_one_without_room_is_left_out() {
        let label = Wanted { at: [195.0, 100.0], size: [40.0, 10.0] };
        let [Some(at)] = place(&[label], &[], ROOM)[..] else { panic!("no place") };
        assert!(at[1][0] < 200.0);
        assert_eq!(place(&[Wanted { size: [300.0, 10.0], ..label }], &[], ROOM), [None]);
    }
}
