//! How far a simulated grasp may be from the exact solution of its own equations: a band about every channel, estimated
//! from a refined run that computes the same grasp more finely.
//!
//! If errors shrink by a factor r from a simulation to its refined run, the simulation's error is the difference times
//! 1 / (1 - r): r = 1/4 for SDIRK2 at a tenth of the tolerance, 1/2 for rapier at half the step. With fixed steps of
//! Euler the refined run is close to the truth, so the difference from it is the error; see
//! [`Solver::refined`](palpate_sim::scene::Solver::refined). The difference may pass through zero where the error does
//! not, so a band takes the largest estimate within a tenth of a second on either side, times a factor for effects that
//! the theory neglects. A test measures how often the band covers the truth.
//!
//! If a free object can slip either way, simulation and refined run may end in different grasps; the band is then as
//! wide as the difference between them, and does not shrink with the step.
//!
//! The band contains only the error of integration, not the difference between the equations and a real gripper.

use super::run::{GraspRun, prepare_refined};
use glam::DVec3;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::{EngineKind, IntegrationMethod, Scene};
use palpate_tactile::trial::SimulatedTrial;
use palpate_tactile::{Channel, Quantity, Sensors, SignalDefinition};
use serde::{Deserialize, Serialize};

/// Estimated errors of several channels, sample by sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ErrorBand {
    /// Estimated error per difference.
    factor: f64,
    t_s: Vec<f64>,
    /// Estimated errors, one row per channel.
    estimates: Vec<Vec<f32>>,
}

/// Time on either side within which the largest estimate counts (s): from one change of pressure to the next.
const REACH: f64 = 0.1;
/// Factor of estimates for what the theory leaves out, beside a refined run that shares the method, and beside
/// one that is close to the truth (fixed steps of Euler). Over eight objects in two poses of preset M each, fixed and free,
/// bands cover 0.98 of all samples at draft and standard and 0.975 at 1e-5, and at least 0.82 of those of any grasp. They
/// are five, two and eight times as wide as the error, root mean squares over all.
const SAFETY: f64 = 2.0;
const SAFETY_BESIDE_THE_TRUTH: f64 = 1.5;

impl ErrorBand {
    /// A band without samples, for as many channels.
    pub fn new(scene: &Scene, channels: usize) -> Self {
        let factor = match (scene.solver.engine, scene.solver.method()) {
            (EngineKind::Palpate, IntegrationMethod::Sdirk2) => SAFETY / (1.0 - 0.25),
            (EngineKind::Palpate, IntegrationMethod::Euler) => SAFETY_BESIDE_THE_TRUTH,
            (EngineKind::Rapier, _) => SAFETY / (1.0 - 0.5),
        };
        Self { factor, t_s: Vec::new(), estimates: vec![Vec::new(); channels] }
    }

    /// Adds what the channels read at one time (s), in the simulation and in its refined run. Returns the estimates.
    pub fn push(&mut self, t: f64, values: &[Option<f64>], refined: &[Option<f64>]) -> Vec<f32> {
        self.t_s.push(t);
        let pairs = values.iter().zip(refined).zip(&mut self.estimates);
        pairs
            .map(|((value, finer), row)| {
                let difference = value.unwrap_or_default() - finer.unwrap_or_default();
                let estimate = (self.factor * difference.abs()) as f32;
                row.push(estimate);
                estimate
            })
            .collect()
    }

    /// Half the width of the band about one channel at one sample, in the channel's unit; `None` where there is none.
    pub fn half_width(&self, channel: usize, sample: usize) -> Option<f64> {
        band_half_width(&self.t_s, self.estimates.get(channel)?, sample)
    }

    /// The band in a few numbers, beside what the channels read.
    pub fn norms(&self, trial: &SimulatedTrial, sensors: &Sensors) -> ErrorNorms {
        let readings: Vec<Vec<Option<f64>>> = trial.frames().iter().map(|frame| sensors.read(frame)).collect();
        ErrorNorms::new(sensors.channels(), &readings, |channel, sample| self.half_width(channel, sample))
    }
}

/// Errors of a trial in a few numbers: root mean squares over samples and channels, and their shares of the range that
/// those channels pass through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorNorms {
    /// Curvature (1/m).
    pub curvature_per_m: f64,
    /// Curvature, as a share of its range.
    pub curvature_share: f64,
    /// Pressure (Pa).
    pub pressure_pa: f64,
    /// Pressure, as a share of its range.
    pub pressure_share: f64,
    /// Force (N).
    pub force_n: f64,
    /// Force, as a share of its range.
    pub force_share: f64,
}

impl ErrorNorms {
    /// What `error` gives for channel and sample, summed up; samples without an error are left out.
    pub fn new(
        channels: &[Channel],
        readings: &[Vec<Option<f64>>],
        error: impl Fn(usize, usize) -> Option<f64>,
    ) -> Self {
        let of = |wanted: fn(Quantity) -> bool| {
            let own = || channels.iter().enumerate().filter(move |(_, c)| wanted(c.quantity)).map(|(i, _)| i);
            let errors = own().flat_map(|i| (0..readings.len()).map(move |k| (i, k))).filter_map(|(i, k)| error(i, k));
            let (sum, count) = errors.fold((0.0, 0u32), |(sum, count), e| (sum + e * e, count + 1));
            let values = || own().flat_map(|i| readings.iter().filter_map(move |row| row.get(i).copied().flatten()));
            let range = values().fold(0.0, f64::max) - values().fold(0.0, f64::min);
            let rms = (sum / f64::from(count.max(1))).sqrt();
            (rms, if range > 0.0 { rms / range } else { 0.0 })
        };
        let (curvature_per_m, curvature_share) = of(|own| own == Quantity::Curvature);
        let (pressure_pa, pressure_share) = of(Quantity::is_pressure);
        let (force_n, force_share) = of(|own| own == Quantity::Force);
        Self { curvature_per_m, curvature_share, pressure_pa, pressure_share, force_n, force_share }
    }

    /// How far one trial is from another, sampled at the same times; the range is that of both.
    pub fn between(trial: &SimulatedTrial, other: &SimulatedTrial, sensors: &Sensors) -> Self {
        Self::between_sensed([(trial, sensors), (other, sensors)])
    }

    /// The same for circles and contact pressure of whole fingers, where the trials may differ in joints and taxels.
    pub fn of_whole_fingers(trial: &SimulatedTrial, other: &SimulatedTrial) -> Self {
        let [own, others] =
            [trial, other].map(|trial| Sensors::whole_fingers(&trial.header.scene.gripper, SignalDefinition::Contact));
        Self::between_sensed([(trial, &own), (other, &others)])
    }

    /// Difference of two trials, each read by its sensors, which have the same channels.
    fn between_sensed([trial, other]: [(&SimulatedTrial, &Sensors); 2]) -> Self {
        let read = |(trial, sensors): (&SimulatedTrial, &Sensors)| -> Vec<Vec<Option<f64>>> {
            trial.frames().iter().map(|f| sensors.read(f)).collect()
        };
        let (mut rows, others) = (read(trial), read(other));
        let (own, common) = (rows.len(), rows.len().min(others.len()));
        rows.extend(others);
        Self::new(trial.1.channels(), &rows, |channel, sample| {
            // Without contact there is no pressure.
            let value = |sample: usize| Some(rows.get(sample)?.get(channel)?.unwrap_or_default());
            if sample < common { Some(value(sample)? - value(own + sample)?) } else { None }
        })
    }
}

/// Half the width of a band at one sample, from the estimates of one channel and their times (s): the largest estimate
/// near it.
pub fn band_half_width(t_s: &[f64], estimates: &[f32], sample: usize) -> Option<f64> {
    let now = *t_s.get(sample)?;
    let near = |k: &usize| (t_s[*k] - now).abs() <= REACH + 1e-9;
    let count = t_s.len().min(estimates.len());
    let after = (sample..count).take_while(near);
    let around = (0..sample.min(count)).rev().take_while(near).chain(after);
    around.map(|k| f64::from(estimates[k])).reduce(f64::max)
}

/// Runs the refined run of a grasp that was made from this scene, and gives the band about it.
pub fn error_band(trial: &SimulatedTrial, scene: &Scene, object: Option<&ObjectModel>, sensors: &Sensors) -> ErrorBand {
    let mut refined = RefinedRun::new(scene, object, trial.header.seed, sensors.channels().len());
    for frame in trial.frames() {
        refined.errors(frame.t, &sensors.read(frame), sensors);
    }
    refined.band
}

/// Refined run of a grasp, which advances sample by sample beside it.
pub(crate) struct RefinedRun {
    run: GraspRun,
    band: ErrorBand,
}

impl RefinedRun {
    /// Creates the refined run of a grasp that starts.
    pub(crate) fn new(scene: &Scene, object: Option<&ObjectModel>, seed: u64, channels: usize) -> Self {
        Self { run: prepare_refined(scene, object, seed), band: ErrorBand::new(scene, channels) }
    }

    /// Advances by one sample and returns the estimated errors of the sensor values at that time (s); empty at its end.
    pub(crate) fn errors(&mut self, t: f64, values: &[Option<f64>], sensors: &Sensors) -> Box<[f32]> {
        match self.run.next_frame() {
            Some(finer) => self.band.push(t, values, &sensors.read(finer)).into(),
            None => Box::default(),
        }
    }

    /// Applies the same pull to the object as in the watched grasp (N, world axes).
    pub(crate) fn pull(&mut self, force: DVec3) {
        self.run.simulation_mut().pull_object(force);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::grasp;
    use glam::DVec3;
    use palpate_geometry::Primitive;
    use palpate_sim::scene::{Accuracy, Integrator};
    use rayon::prelude::*;

    fn sensors(scene: &Scene) -> Sensors {
        Sensors::whole_fingers(&scene.gripper, SignalDefinition::Contact)
    }

    #[test]
    fn a_band_is_as_wide_as_the_largest_estimate_near() {
        let scene = Scene::default();
        let mut band = ErrorBand::new(&scene, 1);
        for k in 0..40 {
            let off = if k == 20 { 0.25 } else { 0.0 };
            band.push(f64::from(k) / 75.0, &[Some(1.0 + off)], &[Some(1.0)]);
        }
        let want = f64::from((0.25 * SAFETY / (1.0 - 0.25)) as f32);
        for (sample, near) in [(12, false), (13, true), (20, true), (27, true), (28, false)] {
            assert_eq!(band.half_width(0, sample), Some(if near { want } else { 0.0 }), "{sample}");
        }
        assert_eq!((band.half_width(0, 40), band.half_width(1, 0)), (None, None));
    }

    #[test]
    fn norms_are_root_mean_squares_and_shares_of_the_range() {
        let scene = Scene::default();
        let sensors = sensors(&scene);
        let count = sensors.channels().len();
        let readings: Vec<Vec<Option<f64>>> = (0..5).map(|k| vec![Some(f64::from(k)); count]).collect();
        let norms =
            ErrorNorms::new(sensors.channels(), &readings, |_, sample| Some(if sample == 0 { 5.0 } else { 0.0 }));
        let rms = (25.0f64 / 5.0).sqrt();
        for (size, share) in [
            (norms.curvature_per_m, norms.curvature_share),
            (norms.pressure_pa, norms.pressure_share),
            (norms.force_n, norms.force_share),
        ] {
            assert!((size - rms).abs() < 1e-12 && (share - rms / 4.0).abs() < 1e-12, "{norms:?}");
        }
    }

    /// A band compared with the truth, a grasp at a tolerance of 1e-6: samples that it covers, all samples, and the
    /// sums of the squares of half-widths and errors, as shares of the largest reading of their channel.
    fn covered(scene: &Scene, object: &ObjectModel, truth: &SimulatedTrial) -> [f64; 4] {
        let sensors = sensors(scene);
        let trial = grasp(scene, Some(object), 0);
        let band = error_band(&trial, scene, Some(object), &sensors);
        let rows: Vec<Vec<f64>> =
            truth.frames().iter().map(|f| sensors.read(f).iter().map(|v| v.unwrap_or_default()).collect()).collect();
        let mut sums = [0.0; 4];
        for (k, (frame, exact)) in trial.frames().iter().zip(&rows).enumerate() {
            for (channel, (value, want)) in sensors.read(frame).iter().zip(exact).enumerate() {
                let largest = rows.iter().map(|row| row[channel].abs()).fold(1e-9, f64::max);
                let error = (value.unwrap_or_default() - want).abs();
                let half = band.half_width(channel, k).expect("a band about every sample");
                let own =
                    [f64::from(u8::from(error <= half)), 1.0, (half / largest).powi(2), (error / largest).powi(2)];
                sums = std::array::from_fn(|i| sums[i] + own[i]);
            }
        }
        sums
    }

    #[test]
    fn bands_cover_the_truth_in_85_of_100_samples_and_are_not_much_wider_than_the_error() {
        let shapes = [
            Primitive::Sphere { radius: 0.02 },
            Primitive::Cuboid { half: DVec3::new(0.02, 0.03, 0.015) },
            Primitive::Cylinder { radius: 0.0175, half_length: 0.03 },
        ];
        let accuracies = [Accuracy::Draft, Accuracy::Standard, Accuracy::Tolerance(1e-4)];
        let cases: Vec<(Primitive, bool, f64)> =
            shapes.into_iter().flat_map(|shape| [(shape, true, 0.0), (shape, false, 0.004)]).collect();
        let sums: Vec<[[f64; 4]; 3]> = cases
            .par_iter()
            .map(|(shape, fixed, offset)| {
                let object = ObjectModel::from_primitive("it", *shape, 400.0, 0.6);
                let mut scene = Scene::default();
                scene.object.fixed = *fixed;
                scene.gripper.mount.offset = [*offset, 0.5 * offset, 0.0];
                let mut at = |accuracy| {
                    scene.solver.accuracy = accuracy;
                    scene.clone()
                };
                let truth = grasp(&at(Accuracy::Tolerance(1e-6)), Some(&object), 0);
                accuracies.map(|accuracy| covered(&at(accuracy), &object, &truth))
            })
            .collect();
        for (k, accuracy) in accuracies.iter().enumerate() {
            let each: Vec<f64> = sums.iter().map(|row| row[k][0] / row[k][1]).collect();
            let [inside, all, halves, errors] =
                sums.iter().fold([0.0; 4], |sum, row| std::array::from_fn(|i| sum[i] + row[k][i]));
            assert!(inside / all >= 0.85, "{accuracy}: {}, grasp by grasp {each:?}", inside / all);
            let wider = (halves / errors).sqrt();
            assert!(wider < 10.0, "{accuracy}: {wider} times as wide as the error");
        }
    }

    #[test]
    fn a_companion_leaves_the_grasp_as_it_is() {
        let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
        let mut scene = Scene::default();
        scene.timing.duration_s = 1.2;
        scene.solver.integrator = Integrator::Sdirk2;
        let trial = grasp(&scene, Some(&ball), 0);
        let band = error_band(&trial, &scene, Some(&ball), &sensors(&scene));
        assert!(band.half_width(0, trial.frames().len() - 1).is_some());
        assert!(trial == grasp(&scene, Some(&ball), 0));
    }
}
