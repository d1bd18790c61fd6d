//! Curvature of a finger section.
//!
//! A flex strip measures the bend of the length that it covers: kappa = sum(w q) / length, where w is the share of a
//! joint's segment under the strip, over which the angle q of the joint is spread evenly.
//!
//! In the paper's simulation (section IV-A1) it is that of a circle through the tracked joints, kappa = 1 / r. The
//! circle through the joints of a chain that bends by phi per segment of length l has curvature 2 sin(phi / 2) / l,
//! which is phi / l less phi² / 24 of it: 0.09 % low at 8 degrees per joint. A section with fewer than three joints has
//! no circle; there the sum of its joint angles over its length is read instead.

use super::Span;
use glam::DVec2;
use palpate_geometry::signed_curvature;
use palpate_sim::gripper::BentFinger;

/// Curvature (1/m) of a stretch of a bent finger, positive when it bends inward; exactly zero when straight.
pub fn curvature(bent: &BentFinger, q: &[f64], span: &Span) -> f64 {
    let length: f64 = bent.lengths.iter().sum();
    let segment = length / q.len() as f64;
    let inside = |i: usize| span.holds((i as f64 + 0.5) * segment / length);
    // Written along, then inward, so that bending inward turns left.
    let points: Vec<DVec2> =
        bent.joints().enumerate().filter(|(i, _)| inside(*i)).map(|(_, p)| DVec2::new(p.y, p.x)).collect();
    signed_curvature(&points).unwrap_or_else(|| {
        let turned: f64 = q.iter().enumerate().filter(|(i, _)| inside(*i)).map(|(_, q)| q).sum();
        turned / (span.share() * length)
    })
}

/// Bend (1/m) of the stretch of a finger from one length to another, from the palm (m), positive inward; exactly zero when
/// straight.
pub fn strip_curvature(q: &[f64], length: f64, [from, to]: [f64; 2]) -> f64 {
    let segment = length / q.len() as f64;
    let covered = |i: usize| ((i + 1) as f64 * segment).min(to) - (i as f64 * segment).max(from);
    let bent: f64 = q.iter().enumerate().map(|(i, q)| q * (covered(i) / segment).max(0.0)).sum();
    bent / (to - from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sim::gripper::Finger;

    fn read(joints: usize, q: &[f64], span: &Span) -> f64 {
        let finger = Finger { joints, ..Finger::default() };
        curvature(&BentFinger::new(&finger, q), q, span)
    }

    #[test]
    fn an_even_bend_reads_its_curvature_less_the_chord_error() {
        for phi in [0.02, 0.1, -0.14] {
            let kappa = read(10, &[phi; 10], &Span::WHOLE);
            let chord = 2.0 * (0.5 * phi).sin() / 0.01;
            assert!((kappa - chord).abs() < 1e-9, "{kappa} instead of {chord}");
            assert!((kappa / (phi / 0.01) - 1.0 + phi * phi / 24.0).abs() < 1e-4);
        }
    }

    #[test]
    fn a_strip_weighs_joints_by_what_it_covers_of_their_segments() {
        // Segments of 10 mm; 25 to 55 mm covers half of the third, the two between, and half of the sixth.
        let mut q = [0.0; 10];
        q[2] = 0.04;
        q[4] = 0.1;
        q[5] = 0.02;
        q[7] = 5.0;
        let wanted = (0.5 * 0.04 + 0.1 + 0.5 * 0.02) / 0.03;
        assert!((strip_curvature(&q, 0.1, [0.025, 0.055]) - wanted).abs() < 1e-12);
        // Wholly inside one segment it reads that segment's own bend.
        assert!((strip_curvature(&q, 0.1, [0.042, 0.047]) - 10.0).abs() < 1e-12);
        // An even bend reads the same anywhere, and the whole finger its mean.
        for reach in [[0.0, 0.1], [0.0222, 0.0776], [0.09, 0.1]] {
            assert!((strip_curvature(&[0.14; 10], 0.1, reach) - 14.0).abs() < 1e-9);
        }
        assert_eq!(strip_curvature(&[0.0; 10], 0.1, [0.0222, 0.0776]), 0.0);
        assert!((strip_curvature(&q, 0.1, [0.0, 0.1]) - 51.6).abs() < 1e-9);
    }

    #[test]
    fn straight_is_exactly_zero() {
        for joints in [2, 3, 10, 80] {
            for span in [Span::WHOLE, Span::PROXIMAL, Span::DISTAL] {
                assert_eq!(read(joints, &vec![0.0; joints], &span), 0.0);
            }
        }
    }

    #[test]
    fn few_joints_read_their_angle_over_the_length() {
        // Two joints: one in each half of 50 mm.
        assert!((read(2, &[0.1, 0.3], &Span::PROXIMAL) - 2.0).abs() < 1e-12);
        assert!((read(2, &[0.1, 0.3], &Span::DISTAL) - 6.0).abs() < 1e-12);
        assert!((read(2, &[0.1, 0.3], &Span::WHOLE) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn a_finger_wrapped_on_a_cylinder_reads_its_radius() {
        // Joints on a circle of 40 mm.
        let phi = 2.0 * (0.5f64 * 0.01 / 0.04).asin();
        assert!((read(10, &[phi; 10], &Span::WHOLE) - 25.0).abs() < 1e-9);
    }
}
