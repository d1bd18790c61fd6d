//! Convex hull of planar points, for the paper's contact area A_j (section IV-A1): Andrew's monotone chain.

use glam::DVec2;

/// Area (m²) of the convex hull of `points` (m). Fewer than three points, or points on a line, span no area.
///
/// Sorts `points` in place, so that a caller in a loop need not allocate a copy.
pub fn convex_hull_area(points: &mut [DVec2]) -> f64 {
    if points.len() < 3 {
        return 0.0;
    }
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let lower = half_hull_area(points.iter());
    let upper = half_hull_area(points.iter().rev());
    0.5 * (lower + upper).abs()
}

/// Twice the signed area swept, seen from the origin, by one half of the hull.
fn half_hull_area<'a>(points: impl Iterator<Item = &'a DVec2>) -> f64 {
    let mut chain: Vec<DVec2> = Vec::new();
    for p in points {
        while let [.., a, b] = chain[..]
            && (b - a).perp_dot(*p - a) <= 0.0
        {
            chain.pop();
        }
        chain.push(*p);
    }
    chain.windows(2).map(|w| w[0].perp_dot(w[1])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_contact_patch_of_a_cube() {
        // A 20 mm cube face seen by taxels inside and on its rim.
        let mut points: Vec<DVec2> =
            (0..5).flat_map(|i| (0..5).map(move |j| DVec2::new(0.005 * i as f64, 0.005 * j as f64))).collect();
        assert!((convex_hull_area(&mut points) - 4e-4).abs() < 1e-18);
    }

    #[test]
    fn a_triangle_with_an_inner_point() {
        let mut points = [(0.0, 0.0), (4.0, 0.0), (0.0, 3.0), (1.0, 1.0)].map(DVec2::from);
        assert!((convex_hull_area(&mut points) - 6.0).abs() < 1e-12);
    }

    #[test]
    fn lines_and_points_have_no_area() {
        assert_eq!(convex_hull_area(&mut [DVec2::X, DVec2::Y]), 0.0);
        let mut row: Vec<DVec2> = (0..6).map(|i| DVec2::new(i as f64, 2.0 * i as f64)).collect();
        assert_eq!(convex_hull_area(&mut row), 0.0);
    }
}
