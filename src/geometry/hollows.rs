//! Filling the hollows of a solid that are narrower than a finger.
//!
//! A pad bridges a groove that it is too wide for, where separate springs would reach into it. Seen by a pad, a solid is
//! what a ball of radius r cannot reach from outside (its closing by that ball). Up to a distance of r every point has one
//! nearest point on the filled solid, so the distance has a gradient without jumps there: in a groove, the direction of a
//! contact does not jump from one wall to the other.
//!
//! With E the places where the ball's centre can be, the distance from the filled solid is r - min |x - y| over y in E. On
//! a smooth or convex part of the surface the nearest y lies straight out. Elsewhere it is found from those of neighbours
//! that are nearer to E, and improved.

use super::DistanceGrid;
use glam::DVec3;
use rayon::prelude::*;

/// A node whose ball, moved straight out, is this much short of the radius stands in a hollow (m).
const SHORT: f64 = 3e-5;
/// Share of a cell down to which places of the ball are improved.
const FINE: f64 = 1.0 / 32.0;
/// Depth below the surface down to which distances are changed, in cells.
const BELOW: f64 = 3.0;

impl DistanceGrid {
    /// Fills hollows that a ball of this radius (m) cannot reach. Distances must be exact up to it and two cells more.
    pub(super) fn fill_hollows(&mut self, radius: f64) {
        let band = -BELOW * self.cell..radius;
        let mut nodes: Vec<usize> =
            (0..self.values.len()).filter(|n| band.contains(&f64::from(self.values[*n]))).collect();
        let out: Vec<DVec3> = nodes.par_iter().map(|n| self.straight_out(*n, radius)).collect();
        let reached: Vec<bool> =
            out.par_iter().map(|y| self.reach(*y).is_some_and(|reach| reach > radius - SHORT)).collect();
        if reached.iter().all(|reached| *reached) {
            return;
        }
        // The nearest place of the ball for each node; those outside the band are such places themselves.
        let mut places: Vec<DVec3> = (0..self.values.len()).into_par_iter().map(|n| self.node_of(n)).collect();
        for (n, y) in nodes.iter().zip(&out) {
            places[*n] = *y;
        }
        let mut hollow: Vec<usize> =
            nodes.drain(..).zip(reached).filter_map(|(n, reached)| (!reached).then_some(n)).collect();
        for n in &hollow {
            places[*n] = DVec3::NAN;
        }
        hollow.sort_by(|a, b| self.values[*b].total_cmp(&self.values[*a]).then(a.cmp(b)));
        let mut filled = Vec::with_capacity(hollow.len());
        for n in hollow {
            let (x, distance) = (self.node_of(n), f64::from(self.values[n]));
            let Some((value, place)) = self.nearest_ball(n, x, &places, radius) else { continue };
            places[n] = place;
            filled.push((n, value.min(distance) as f32));
        }
        for (n, distance) in filled {
            self.values[n] = distance;
        }
    }

    fn node_of(&self, n: usize) -> DVec3 {
        let [_, ny, nz] = self.size;
        self.node([n / (ny * nz), n / nz % ny, n % nz])
    }

    /// Distance from the solid, within the grid (m).
    fn reach(&self, p: DVec3) -> Option<f64> {
        self.interpolated(p)
    }

    /// Place of the ball straight out from a node.
    fn straight_out(&self, n: usize, radius: f64) -> DVec3 {
        let x = self.node_of(n);
        let slope = |axis: DVec3| {
            let at = |side: f64| self.reach(x + axis * (side * self.cell)).unwrap_or_default();
            at(1.0) - at(-1.0)
        };
        let out = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)).normalize_or_zero();
        x + out * (radius - f64::from(self.values[n]))
    }

    /// Distance of a node from the filled solid (m), and the nearest place of the ball's centre, from those of the
    /// neighbours.
    fn nearest_ball(&self, n: usize, x: DVec3, places: &[DVec3], radius: f64) -> Option<(f64, DVec3)> {
        let value = |y: DVec3| Some(self.reach(y).filter(|reach| *reach >= radius - SHORT)? - (y - x).length());
        let [_, ny, nz] = self.size;
        let around = || (0..27).map(|k: i32| [k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1]);
        let near = around().filter_map(|[i, j, k]| {
            let m = n as i64 + (i64::from(i) * ny as i64 + i64::from(j)) * nz as i64 + i64::from(k);
            let y = *places.get(usize::try_from(m).ok()?)?;
            y.is_finite().then(|| Some((value(y)?, y))).flatten()
        });
        let (mut best, mut place) = near.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let mut step = 0.5 * self.cell;
        while step > FINE * self.cell {
            let tried = around().filter_map(|way| {
                let y = place + DVec3::from_array(way.map(f64::from)) * step;
                Some((value(y)?, y))
            });
            match tried.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(value, _)| *value > best + 1e-9) {
                Some(found) => (best, place) = found,
                None => step *= 0.5,
            }
        }
        Some((best, place))
    }
}
