//! Places for labels beside points, so that they cover neither each other nor points: in files and in the window.

use super::canvas::{RADIUS, line_width};
use palpate_geometry::drawing::{Marker, Plot};

/// A rectangle: lower and upper corner (points).
pub(super) type Box2 = [[f64; 2]; 2];

/// A label of a plot in its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedLabel<'a> {
    pub text: &'a str,
    /// Number of its series' colour.
    pub colour: usize,
    pub room: Box2,
    /// Line from its point, where it is farther away.
    pub lead: Option<[[f64; 2]; 2]>,
}

/// Places labels of points that are chosen by `labelled` within a room; those without a free place are left out. `at`
/// is the place of values, `size` that of a text; obstacles are kept clear beside points and lines.
pub fn placed_labels<'a, E>(
    plot: &'a Plot,
    at: impl Fn([f64; 2]) -> Option<[f64; 2]>,
    size: impl Fn(&str) -> Result<[f64; 2], E>,
    labelled: impl Fn(&str) -> bool,
    (mut obstacles, room): (Vec<Box2>, Box2),
) -> Result<Vec<PlacedLabel<'a>>, E> {
    let around = |[x, y]: [f64; 2], radius: f64| [[x - radius, y - radius], [x + radius, y + radius]];
    let (mut wanted, mut texts) = (Vec::new(), Vec::new());
    // Those of later series are placed first.
    for series in plot.series.iter().rev() {
        let places: Vec<Option<[f64; 2]>> = series.points.iter().map(|point| at(point.at)).collect();
        if series.marker != Marker::None {
            obstacles.extend(places.iter().flatten().map(|place| around(*place, RADIUS + 1.5)));
        }
        let known: Vec<[f64; 2]> = places.iter().flatten().copied().collect();
        if let Some(width) = line_width(series.line) {
            obstacles.extend(known.windows(2).flat_map(|pair| along(pair[0], pair[1])).map(|at| around(at, width)));
        }
        let is_labelled = |label: &str| !label.is_empty() && labelled(label);
        for (point, place) in series.points.iter().zip(places).filter(|(point, _)| is_labelled(&point.label)) {
            let Some(at) = place else { continue };
            wanted.push(Wanted { at, size: size(&point.label)? });
            texts.push((point.label.as_str(), series.colour));
        }
    }
    let placed = wanted.iter().zip(place(&wanted, &obstacles, room)).zip(texts);
    let label = |((label, room), (text, colour)): ((&Wanted, Option<Box2>), (&'a str, usize))| {
        let room = room?;
        let nearest = [0, 1].map(|k| label.at[k].clamp(room[0][k], room[1][k]));
        let distance = (nearest[0] - label.at[0]).hypot(nearest[1] - label.at[1]);
        let from = [0, 1].map(|k| label.at[k] + (nearest[k] - label.at[k]) * (RADIUS / distance));
        Some(PlacedLabel { text, colour, room, lead: (distance > NEAR).then_some([from, nearest]) })
    };
    Ok(placed.filter_map(label).collect())
}

/// Places along a line, for labels to avoid.
fn along(from: [f64; 2], to: [f64; 2]) -> Vec<[f64; 2]> {
    const EVERY: f64 = 4.0;
    let pieces = ((to[0] - from[0]).hypot(to[1] - from[1]) / EVERY).ceil().max(1.0);
    (0..pieces as usize).map(|n| [0, 1].map(|k| from[k] + (to[k] - from[k]) * (n as f64 / pieces))).collect()
}

/// A label to be placed.
#[derive(Clone, Copy, Debug)]
struct Wanted {
    /// Point that it belongs to.
    at: [f64; 2],
    /// Width and height of its text.
    size: [f64; 2],
}

/// Distances of a label from its point (points); farther ones get a line to it.
const DISTANCES: [f64; 4] = [5.0, 12.0, 22.0, 36.0];
/// A label this near needs no line to its point (points).
const NEAR: f64 = 9.0;
/// Directions from the point to the nearest edge of the label, best first.
const DIRECTIONS: [[f64; 2]; 8] =
    [[1.0, 0.0], [0.7, -0.7], [0.7, 0.7], [-1.0, 0.0], [0.0, -1.0], [0.0, 1.0], [-0.7, -0.7], [-0.7, 0.7]];

/// Place of each label, in order; `None` if it would cover another label or leave the room. If no place is free of
/// obstacles, the place that covers the least of them is taken, and nearer ones are preferred.
fn place(wanted: &[Wanted], obstacles: &[Box2], room: Box2) -> Vec<Option<Box2>> {
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
