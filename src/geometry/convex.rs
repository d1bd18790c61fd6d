//! Convex hull of points in space (parry3d does the work).

use super::{Bounds, MeshError, TriMesh};
use glam::{DVec3, Vec3};

/// The smallest convex mesh around some points. Fails for points that span no volume.
pub fn convex_hull(points: &[DVec3]) -> Result<TriMesh, MeshError> {
    if let Some(index) = points.iter().position(|p| !p.is_finite()) {
        return Err(MeshError::NotFinite { index });
    }
    let bounds = Bounds::of(points.iter().copied());
    let size = bounds.size();
    // Flat sets are refused here, where a tolerance can be chosen, rather than in the hull's own arithmetic.
    if points.len() < 4 || size.min_element() <= 1e-6 * size.max_element() {
        return Err(MeshError::NoVolume);
    }
    let unit: Vec<Vec3> = points.iter().map(|p| ((*p - bounds.centre()) / size.max_element()).as_vec3()).collect();
    match parry3d::transformation::try_convex_hull(&unit) {
        Ok((points, triangles)) => Ok(TriMesh {
            points: points.iter().map(|p| bounds.centre() + p.as_dvec3() * size.max_element()).collect(),
            triangles,
        }),
        Err(error) => {
            tracing::debug!("convex hull: {error:?}");
            Err(MeshError::NoVolume)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_cube_with_points_inside() {
        let points: Vec<DVec3> =
            (0..27u32).map(|i| DVec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)) * 0.01).collect();
        let hull = convex_hull(&points).expect("a volume");
        assert!((hull.signed_volume() - 8e-6).abs() < 1e-11);
        assert_eq!(convex_hull(&points[..9]).err(), Some(MeshError::NoVolume));
    }
}
