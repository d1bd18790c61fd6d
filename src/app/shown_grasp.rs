//! Pads and fingers of the grasp that is shown, live or stored, as heat maps: at the time shown, and over all its time.

use crate::app::features::view::ViewSource;
use crate::app::heat_map::{MapsKey, ShownMaps, shown_maps};
use crate::app::shown::DisplayedData;
use crate::app::traces::GraspTrace;
use egui::Ui;
use palpate_geometry::units;
use palpate_lab::inspection::PhaseSpan;
use palpate_lab::picture::{
    BendUnit, LoadUnit, PAD_FULL_SCALE, SensorRows, channels_over_time, full_scale_of, joints_over_time,
    pad_rows_over_time, pads_at, touched_rows, whole_pads,
};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, Side};
use palpate_tactile::Quantity;
use palpate_tactile::electronics::PadPart;
use std::ops::Range;

/// Least pressure that has the brightest colour while grasps run (Pa).
const LEAST_RUNNING: f32 = 20e3;
/// Most columns of a heat map over time.
pub(super) const MAP_COLUMNS: usize = 600;

/// The grasp that is data.
pub(super) struct ShownGrasp<'a> {
    gripper: &'a GripperModel,
    /// Simulated frames, in order; none of a real gripper.
    pub(super) frames: Vec<&'a Frame>,
    /// Pressure on the pads that has the brightest colour (Pa).
    pub(super) full_scale: f32,
    /// Rows of taxels that are shown: those touched so far, to the tip.
    rows: Range<usize>,
    /// Frame at the time shown; none of a real gripper.
    frame: Option<&'a Frame>,
    trace: Option<&'a GraspTrace>,
    /// Columns of the trace with the curvature, force and pressure of each finger.
    columns: Vec<(usize, Quantity, Side)>,
    /// Time shown (s).
    pub(super) cursor_s: f64,
    /// First and last time (s).
    pub(super) span_s: [f64; 2],
    window_s: Option<[f64; 2]>,
    pub(super) phases: Vec<PhaseSpan>,
}

/// Load on one pad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PadLoad {
    /// Normal force (N); NaN where it is unknown.
    force: f64,
    /// Largest pressure on a taxel (Pa); none without taxels.
    peak: Option<f64>,
}

impl<'a> ShownGrasp<'a> {
    /// The grasp that is shown; none before there is anything of it.
    pub(super) fn of(data: &DisplayedData<'a>) -> Option<Self> {
        let trace = data.traces.current();
        let (gripper, frames, frame) = match data.source {
            ViewSource::Simulation => {
                let snapshot = data.snapshot?;
                let own = trace.filter(|trace| trace.grasp == snapshot.grasp);
                let frames = own.map(|trace| trace.frames.iter().flatten().map(|frame| &**frame).collect());
                (&snapshot.scene.gripper, frames.unwrap_or_default(), data.moment().map(|moment| moment.frame))
            }
            ViewSource::Trial => {
                let trial = data.inspected?.trial;
                let frames = || trial.frames.iter().map(|frame| &**frame).collect();
                let frames: Vec<&Frame> = if trial.simulated.is_some() { frames() } else { Vec::new() };
                let frame = data.moment().map(|moment| moment.frame).filter(|_| trial.simulated.is_some());
                (&trial.header.scene.gripper, frames, frame)
            }
            ViewSource::Gripper => (&data.scene.gripper, Vec::new(), None),
        };
        if frame.is_none() && trace.is_none_or(|trace| trace.t.is_empty()) {
            return None;
        }
        let column = |(k, channel): (usize, Option<&palpate_tactile::Channel>)| {
            channel.and_then(|channel| Some((k, channel.quantity, channel.side()?)))
        };
        let span_s = data.time_span();
        let full_scale = match frames.as_slice() {
            [] => PAD_FULL_SCALE,
            frames => {
                // A running grasp begins with the scale at which most end, so that colours keep their meaning.
                let least = if data.source == ViewSource::Simulation { LEAST_RUNNING } else { 0.0 };
                full_scale_of(gripper, frames.iter().copied()).max(least)
            }
        };
        let rows = touched_rows(gripper, frames.iter().copied().chain(frame));
        Some(Self {
            gripper,
            frames,
            full_scale,
            rows,
            frame,
            trace,
            columns: data.channels().into_iter().enumerate().filter_map(column).collect(),
            cursor_s: data.time_s().or(frame.map(|frame| frame.t)).unwrap_or(span_s[0]),
            span_s,
            window_s: data.view.time_window,
            phases: data.phases.to_vec(),
        })
    }

    /// What is read at the time of the fingers in the picture: of a real gripper now, also while plots show the last trial.
    pub(super) fn beside_fingers(data: &DisplayedData<'a>) -> Option<Self> {
        let own = Self::of(data)?;
        let now = data.traces.newest().filter(|_| data.source == ViewSource::Gripper && !data.looks_back());
        let Some((trace, cursor_s)) = now.and_then(|trace| Some((trace, *trace.t.last()?))) else { return Some(own) };
        Some(Self { trace: Some(trace), cursor_s, ..own })
    }

    /// What to do where there is none.
    pub(super) fn missing(data: &DisplayedData<'_>) -> &'static str {
        match data.source {
            ViewSource::Trial if data.opening => "Opening the trial …",
            ViewSource::Trial => "Choose a trial in the library.",
            ViewSource::Simulation => "Start a grasp: press Space.",
            ViewSource::Gripper => "Connect the gripper (Ctrl+G), then record a grasp (R).",
        }
    }

    /// True where the load on every taxel is known.
    pub(super) fn is_simulated(&self) -> bool {
        self.frame.is_some()
    }

    /// True once it has something to show over time.
    pub(super) fn has_course(&self) -> bool {
        self.frames.len() > 1 || (self.frame.is_none() && self.trace.is_some_and(|trace| trace.t.len() > 1))
    }

    /// Load on both pads at the time data.
    pub(super) fn pads(&self) -> [PadLoad; 2] {
        let grid = self.gripper.taxels();
        Side::BOTH.map(|side| match self.frame {
            Some(frame) => {
                let peak = frame.loads(side, grid.count()).map(|(_, load)| f64::from(load.normal)).fold(0.0, f64::max);
                PadLoad { force: frame.normal_force(side, grid.count()), peak: Some(peak / grid.area()) }
            }
            None => PadLoad { force: self.read_force(side), peak: None },
        })
    }

    /// Force on a pad as sensors read it at the time shown (N); NaN where they do not.
    fn read_force(&self, side: Side) -> f64 {
        let from_pressure = || self.read(Quantity::Pressure, side).map(|pressure| pressure * PadPart::ACTIVE_AREA);
        self.read(Quantity::Force, side).or_else(from_pressure).unwrap_or(f64::NAN)
    }

    /// Value of a channel at the time shown.
    pub(super) fn read(&self, wanted: Quantity, side: Side) -> Option<f64> {
        let trace = self.trace?;
        let (column, ..) = self.columns.iter().find(|(_, quantity, own)| *quantity == wanted && *own == side)?;
        let value = f64::from(*trace.channels.get(*column)?.get(trace.sample_at(self.cursor_s)?)?);
        Some(value).filter(|value| value.is_finite())
    }

    /// Time to show in heat maps over time (s).
    pub(super) fn time_shown(&self) -> [f64; 2] {
        let [first, last] = self.span_s;
        let fits = |[from, to]: &[f64; 2]| *from >= first && to > from && *to <= last + 1e-9;
        self.window_s.filter(fits).unwrap_or([first, last.max(first + 1e-3)])
    }

    /// Identity of frames or rows, from which maps are made.
    fn key(&self, unit: &'static str, most: [usize; 2]) -> MapsKey {
        let frame = |frame: Option<&&Frame>| frame.map_or(0, |frame| std::ptr::from_ref(*frame) as usize);
        let (count, identity) = match (self.frames.as_slice(), self.trace) {
            ([], Some(trace)) => {
                let last = trace.t.last().copied().unwrap_or(0.0);
                (trace.t.len(), [trace.grasp as usize, last.to_bits() as usize])
            }
            (frames, _) => (frames.len(), [frame(frames.first()), frame(frames.last())]),
        };
        MapsKey { frames: identity, count, unit, most }
    }

    /// Columns of the trace with a quantity of a finger.
    fn columns_of(&self, wanted: Quantity, side: Side) -> Vec<&'a [f32]> {
        let Some(trace) = self.trace else { return Vec::new() };
        let own = self.columns.iter().filter(|(_, quantity, own)| *quantity == wanted && *own == side);
        own.filter_map(|(column, ..)| trace.channels.get(*column).map(Vec::as_slice)).collect()
    }

    fn sensed(&self, wanted: Quantity, rows: SensorRows, columns: usize) -> [palpate_geometry::drawing::HeatMap; 2] {
        let times = self.trace.map_or(&[][..], |trace| &trace.t);
        let sides = Side::BOTH.map(|side| self.columns_of(wanted, side));
        channels_over_time(times, [&sides[0], &sides[1]], rows, columns)
    }
}

impl PadLoad {
    /// `1.23 N`.
    pub(super) fn force_text(&self) -> String {
        units::shown(self.force, "N")
    }

    /// `peak 31.0 kPa`.
    pub(super) fn peak_text(&self) -> Option<String> {
        self.peak.map(|peak| format!("peak {}", units::shown(1e-3 * peak, "kPa")))
    }

    /// `left pad: 1.23 N, peak 31.0 kPa`.
    pub(super) fn about(&self, side: &str) -> String {
        let peak = self.peak_text().map(|peak| format!(", {peak}")).unwrap_or_default();
        format!("{side} pad: {}{peak}", self.force_text())
    }
}

/// Both pads at the time shown: taxel by taxel, or of a real gripper the one value that each has.
pub(super) fn shown_pads(ui: &Ui, name: &'static str, grasp: &ShownGrasp<'_>, unit: LoadUnit) -> ShownMaps {
    let forces = Side::BOTH.map(|side| grasp.read_force(side));
    let identity = match grasp.frame {
        Some(frame) => [std::ptr::from_ref(frame) as usize, frame.t.to_bits() as usize],
        None => forces.map(|force| force.to_bits() as usize),
    };
    let key = MapsKey { frames: identity, count: grasp.rows.len(), unit: unit.symbol(), most: [usize::MAX; 2] };
    shown_maps(ui, name, key, || match grasp.frame {
        Some(frame) => pads_at(grasp.gripper, frame, unit, grasp.full_scale, &grasp.rows),
        None => whole_pads(grasp.gripper, forces, PadPart::ACTIVE_AREA, unit),
    })
}

/// Bending over time: of every joint, or of a real gripper as its strips read it.
pub(super) fn shown_joints(ui: &Ui, grasp: &ShownGrasp<'_>, unit: BendUnit, most: [usize; 2]) -> ShownMaps {
    shown_maps(ui, "joints", grasp.key(unit.symbol(), most), || match grasp.frames.as_slice() {
        [] => grasp.sensed(Quantity::Curvature, SensorRows::Curvature, most[0]),
        frames => joints_over_time(grasp.gripper, frames, unit),
    })
}

/// Load over time: of every row of taxels, or of a real gripper as its pads read it.
pub(super) fn shown_rows(ui: &Ui, grasp: &ShownGrasp<'_>, unit: LoadUnit, most: [usize; 2]) -> ShownMaps {
    shown_maps(ui, "rows", grasp.key(unit.symbol(), most), || match (grasp.frames.as_slice(), unit) {
        ([], LoadUnit::Pressure) => grasp.sensed(Quantity::Pressure, SensorRows::Pressure, most[0]),
        ([], LoadUnit::Force) => grasp.sensed(Quantity::Force, SensorRows::Force(PadPart::ACTIVE_AREA), most[0]),
        (frames, _) => pad_rows_over_time(grasp.gripper, frames, unit, &grasp.rows),
    })
}
