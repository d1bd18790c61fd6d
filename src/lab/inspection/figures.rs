//! Figures of opened trials: one grasp, several overlaid, means of classes, and heat maps. The window shows and exports
//! the same figures that `palpate plot` draws.

use super::comparison::{Alignment, MeanTrial};
use super::open_trial::{Column, OpenTrial};
use super::phases::TouchPhase;
use crate::datasets::{SensorView, scene_hash};
use crate::picture::{BendUnit, LoadUnit, joints_over_time, pad_rows_over_time, touched_rows};
use palpate_geometry::drawing::{
    DataPoint, DataSeries, Figure, HeatMap, LineStyle, Plot, PlotAxis, ReferenceLine, SpreadBand,
};
use palpate_geometry::palette::{NO_SERIES, SHOWN_SERIES};
use palpate_geometry::units::read_in;
use palpate_sim::gripper::Side;
use palpate_tactile::SignalDefinition;
use palpate_tactile::trial::{TrialId, TrialSource};

/// What a heat map shows over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeatKind {
    /// Bending of each joint.
    Joints(BendUnit),
    /// Load on each row of taxels.
    Pads(LoadUnit),
}

impl HeatKind {
    /// What a trial must have for it.
    fn name(self) -> &'static str {
        match self {
            Self::Joints(_) => "joint angles",
            Self::Pads(_) => "taxels",
        }
    }
}

/// Choice of what a figure shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FigureOptions {
    /// A plot for each: the name of a channel, the beginning of names (`pressure`), or `line`; all of them where empty.
    pub channels: Vec<String>,
    /// Common time of several trials.
    pub align: Alignment,
    /// Mean and spread of the trials of each object, in place of single trials.
    pub mean: bool,
    /// Raw counts of a real gripper, in place of channels derived from them.
    pub raw: bool,
    /// Heat maps over time, in place of curves.
    pub heat: Option<HeatKind>,
    /// Number of the colour of each trial; their places where empty.
    pub colours: Vec<usize>,
}

/// Reason why there is no figure.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct FigureDataError(String);

/// Trials named one by one in a caption.
const NAMED: usize = 4;
/// Names of channels in an error.
const LISTED: usize = 24;

/// Facts that make a figure repeatable, in lines: each trial's object, source, seed, scene and version, and the version
/// that drew it.
pub fn caption(trials: &[&OpenTrial]) -> String {
    let line = |trial: &&&OpenTrial| {
        let mut line = format!("{}: trial {}, {}", trial.title, trial.id, trial.source_title());
        if trial.source == TrialSource::Simulated {
            let (seed, hash) = (trial.header.seed, scene_hash(&trial.header.scene));
            line.push_str(&format!(", seed {seed}, scene {hash}"));
        }
        line.push_str(&format!(", recorded by Palpate {}", trial.header.version));
        line
    };
    let mut lines: Vec<String> = trials.iter().take(NAMED).map(|trial| line(&trial)).collect();
    if trials.len() > NAMED {
        let ids: Vec<String> = trials[NAMED..].iter().take(20).map(|trial| trial.id.to_string()).collect();
        let more = if trials.len() > NAMED + ids.len() { "…" } else { "" };
        lines.push(format!("and {} more: {}{more}", trials.len() - NAMED, ids.join(", ")));
    }
    let read = trials.iter().find(|trial| trial.source == TrialSource::Simulated);
    let signals = |view: &SensorView| match view.signals {
        SignalDefinition::Parts => "",
        SignalDefinition::Contact => ", contact pressure",
        SignalDefinition::Hull => ", contact pressure over the hull",
    };
    let sensors = read.map(|trial| format!(", sensors {}{}", trial.sensors.layout, signals(&trial.sensors)));
    let sensors = sensors.unwrap_or_default();
    lines.push(format!("Drawn by Palpate {}{sensors}", env!("CARGO_PKG_VERSION")));
    lines.join("\n")
}

/// A figure of one trial, or of several over each other: a plot per quantity, a colour per trial (with one trial, per place
/// on the finger), the right finger dashed.
pub fn comparison_figure(trials: &[&OpenTrial], options: &FigureOptions) -> Result<Figure, FigureDataError> {
    let Some(first) = trials.first() else {
        return Err(FigureDataError("no trial is chosen; choose at least one".to_owned()));
    };
    let title = match trials {
        [one] => match options.heat {
            Some(heat) => format!("{}, trial {}, {}", one.title, one.id, heat.name()),
            None => format!("{}, trial {}", one.title, one.id),
        },
        _ if trials.len() <= LISTED_IDS => each(trials),
        _ => format!("{}: {}", titles(trials), numbers(trials)),
    };
    let plots = match options.heat {
        Some(kind) => heat_plots(trials, kind)?,
        None => {
            let simulated = trials.iter().find(|trial| trial.source != TrialSource::Recorded).filter(|_| options.raw);
            if let Some(trial) = simulated {
                return Err(lacking(trial, "trials of the real gripper", "raw counts"));
            }
            let origins = origins(trials, options.align);
            let terms = if options.channels.is_empty() { stems(first, options.raw) } else { options.channels.clone() };
            let plots = terms.iter().map(|term| curves(trials, &origins, term, options));
            plots.collect::<Result<Vec<Plot>, _>>()?
        }
    };
    let columns = if options.heat.is_some() { 2 } else { plots.len().min(if plots.len() == 4 { 2 } else { 3 }) };
    let legend = legend(&plots, trials.len());
    Ok(Figure { title, plots, columns, legend, note: caption(trials) })
}

/// One legend of all plots: each series once, and with several trials the line style of each finger.
fn legend(plots: &[Plot], trials: usize) -> Vec<DataSeries> {
    let mut legend: Vec<DataSeries> = Vec::new();
    let all = || plots.iter().flat_map(|plot| &plot.series);
    for series in all().filter(|series| !series.name.is_empty()) {
        let entry = DataSeries { points: Vec::new(), ..series.clone() };
        if !legend.contains(&entry) {
            legend.push(entry);
        }
    }
    if trials > 1 && all().any(|series| series.line == LineStyle::Dashed) {
        let key = |(name, dashed): (&str, bool)| line(name.to_owned(), NO_SERIES, dashed, std::iter::empty());
        legend.extend([("left finger", false), ("right finger", true)].map(key));
    }
    legend
}

/// Only others have what was asked for.
fn lacking(trial: &OpenTrial, others: &str, what: &str) -> FigureDataError {
    FigureDataError(format!("trial {} is {}: only {others} have {what}", trial.id, trial.source_title()))
}

/// Objects of several trials: `Lemon (2), Tomato (1)`.
fn titles(trials: &[&OpenTrial]) -> String {
    let texts: Vec<String> = by_title(trials).iter().map(|(title, own)| format!("{title} ({})", own.len())).collect();
    texts.join(", ")
}

/// Objects of a few trials with their numbers: `Lemon (trial 2), Pear (trials 5, 7)`.
fn each(trials: &[&OpenTrial]) -> String {
    let texts: Vec<String> =
        by_title(trials).iter().map(|(title, own)| format!("{title} ({})", numbers(own))).collect();
    texts.join(", ")
}

/// Numbers of several trials: `trials 3 to 7`, `trials 3, 5, 9 …`.
fn numbers(trials: &[&OpenTrial]) -> String {
    trial_numbers(trials.iter().map(|trial| trial.id).collect())
}

/// Numbers of trials in words: `trial 3`, `trials 3 to 7`, `trials 3, 5, 9 …`.
pub fn trial_numbers(mut ids: Vec<TrialId>) -> String {
    ids.sort_unstable();
    ids.dedup();
    match ids[..] {
        [id] => format!("trial {id}"),
        [first, .., last] if ids.len() > 2 && ids.windows(2).all(|pair| pair[1] == pair[0] + 1) => {
            format!("trials {first} to {last}")
        }
        _ => {
            let more = if ids.len() > LISTED_IDS { " …" } else { "" };
            let ids: Vec<String> = ids.iter().take(LISTED_IDS).map(TrialId::to_string).collect();
            format!("trials {}{more}", ids.join(", "))
        }
    }
}

/// Numbers listed in a title.
const LISTED_IDS: usize = 6;

/// Trials of each object, in their order.
fn by_title<'a>(trials: &[&'a OpenTrial]) -> Vec<(&'a str, Vec<&'a OpenTrial>)> {
    let mut titles: Vec<(&str, Vec<&OpenTrial>)> = Vec::new();
    for trial in trials {
        match titles.iter_mut().find(|(title, _)| *title == trial.title) {
            Some((_, own)) => own.push(trial),
            None => titles.push((&trial.title, vec![trial])),
        }
    }
    titles
}

/// Time of each trial that becomes zero (s). A single one keeps its own time, unless aligned at contact.
fn origins(trials: &[&OpenTrial], align: Alignment) -> Vec<f64> {
    match (trials, align) {
        ([_], Alignment::Closing) => vec![0.0],
        _ => trials.iter().map(|trial| align.origin_s(trial)).collect(),
    }
}

/// Columns of a trial that a figure shows: counts also where there is nothing else.
fn shown(trial: &OpenTrial, raw: bool) -> impl Iterator<Item = &Column> {
    let raw = raw || trial.has_counts_alone();
    trial.columns.iter().filter(move |column| {
        let counts = trial.source == TrialSource::Recorded && column.channel.is_none();
        counts == raw && (counts || column.is_read())
    })
}

/// Name of a column without the finger: `pressure` for `pressure_left_distal`.
fn stem(column: &Column) -> &str {
    let cut = ["_left", "_right"].iter().filter_map(|side| column.name.find(side)).min();
    cut.map_or(&column.name, |at| &column.name[..at])
}

/// Different stems, in their order; more than nine plots cannot be read.
fn stems(trial: &OpenTrial, raw: bool) -> Vec<String> {
    let mut stems: Vec<String> = Vec::new();
    for column in shown(trial, raw) {
        let stem = stem(column);
        if !stems.iter().any(|known| known == stem) {
            stems.push(stem.to_owned());
        }
    }
    stems.truncate(9);
    stems
}

/// Curve of a trial in a plot.
struct Curve<'a> {
    name: &'a str,
    side: Option<Side>,
    /// Factor to the shown unit.
    factor: f64,
    values: Box<dyn Fn(usize) -> f64 + 'a>,
}

fn side_of(name: &str) -> Option<Side> {
    Side::BOTH.into_iter().find(|side| name.contains(side.name()))
}

/// Curves of a trial for a term, and their unit.
fn found<'a>(trial: &'a OpenTrial, term: &str, raw: bool) -> Result<(Vec<Curve<'a>>, &'a str), FigureDataError> {
    if term == "line" {
        let values = Box::new(|k: usize| trial.line_bar[k]);
        return Ok((vec![Curve { name: "line pressure", side: None, factor: 1.0, values }], "bar"));
    }
    let begins = |column: &&Column| {
        let rest = column.name.strip_prefix(term);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
    };
    let mut curves = Vec::new();
    let mut unit = "";
    for column in shown(trial, raw).filter(begins) {
        let (own, factor) = read_in(column.unit);
        unit = own;
        let values = Box::new(|k: usize| f64::from(column.values[k]));
        curves.push(Curve { name: &column.name, side: side_of(&column.name), factor, values });
    }
    if curves.is_empty() {
        let mut names: Vec<&str> = shown(trial, raw).map(|column| column.name.as_str()).collect();
        names.push("line");
        let more = if names.len() > LISTED { ", …" } else { "" };
        names.truncate(LISTED);
        let (id, known) = (trial.id, names.join(", "));
        let why = if trial.has_counts_alone() { " (not calibrated)" } else { "" };
        return Err(FigureDataError(format!("trial {id}{why} has no channel \"{term}\"; it has {known}{more}")));
    }
    Ok((curves, unit))
}

/// Title of the vertical axis of a plot.
fn axis_title(term: &str, unit: &str) -> String {
    let name = if term == "line" { "line pressure".to_owned() } else { term.replace('_', " ") };
    if unit.is_empty() { name } else { format!("{name} ({unit})") }
}

fn curves(
    trials: &[&OpenTrial],
    origins: &[f64],
    term: &str,
    options: &FigureOptions,
) -> Result<Plot, FigureDataError> {
    let mut plot = Plot {
        x: PlotAxis::linear(match options.align {
            Alignment::Closing => "time (s)",
            Alignment::Contact => "time since contact (s)",
        }),
        ..Plot::default()
    };
    for (place, (trial, origin)) in trials.iter().zip(origins).enumerate() {
        let own = options.colours.get(place).copied().unwrap_or(place);
        let (curves, unit) = found(trial, term, options.raw)?;
        plot.y = PlotAxis::linear(axis_title(term, unit));
        for (number, curve) in curves.into_iter().enumerate().filter(|_| !options.mean) {
            let dashed = curve.side == Some(Side::Right);
            let (name, colour) = match trials {
                [_] => (one_name(curve.name, term), number / if curve.side.is_some() { 2 } else { 1 }),
                // The right finger is the dashed line of the same colour.
                _ if dashed => (String::new(), own),
                _ => (format!("{}, trial {}", trial.title, trial.id), own),
            };
            let samples = trial.t_s.iter().enumerate();
            let points = samples.map(|(k, t_s)| [t_s - origin, (curve.values)(k) * curve.factor]);
            plot.series.push(line(name, colour, dashed, points));
        }
    }
    if options.mean {
        means(trials, term, options, &mut plot)?;
    }
    plot.references = match trials {
        [one] => phases(one, origins[0]),
        _ if options.align == Alignment::Contact => {
            vec![ReferenceLine { horizontal: false, at: 0.0, text: "contact".to_owned() }]
        }
        _ => Vec::new(),
    };
    Ok(plot)
}

/// Mean of the trials of each object as a line, and its standard deviation as a band.
fn means(trials: &[&OpenTrial], term: &str, options: &FigureOptions, plot: &mut Plot) -> Result<(), FigureDataError> {
    let colours: Vec<(TrialId, usize)> =
        trials.iter().map(|trial| trial.id).zip(options.colours.iter().copied()).collect();
    for (place, (title, own)) in by_title(trials).iter().enumerate() {
        // The first of its trials that is compared gives the colour, as in the window.
        let given = colours.iter().filter(|(id, _)| own.iter().any(|trial| trial.id == *id)).map(|(_, colour)| *colour);
        let colour = given.min_by_key(|colour| *colour == SHOWN_SERIES).unwrap_or(place);
        let Some(mean) = MeanTrial::of(own, options.align) else { continue };
        let (curves, _) = found(own[0], term, options.raw)?;
        for curve in curves {
            let dashed = curve.side == Some(Side::Right);
            let named = if dashed { String::new() } else { format!("{title} (n = {})", mean.trials) };
            let column = mean.columns.iter().find(|column| column.name == curve.name);
            let value = |k: usize| {
                let (middle, spread) =
                    column.map_or((mean.line_bar[k], 0.0), |c| (f64::from(c.mean[k]), f64::from(c.spread[k])));
                (middle * curve.factor, spread * curve.factor)
            };
            let points = mean.t_s.iter().enumerate().map(|(k, t_s)| [*t_s, value(k).0]);
            plot.series.push(line(named, colour, dashed, points));
            let edges = |(k, t_s): (usize, &f64)| {
                let (middle, spread) = value(k);
                [*t_s, middle - spread, middle + spread]
            };
            plot.bands.push(SpreadBand { colour, points: mean.t_s.iter().enumerate().map(edges).collect() });
        }
    }
    Ok(())
}

/// Name of a channel within the plot of its term: `left`, `right distal`.
fn one_name(name: &str, term: &str) -> String {
    let rest = name.strip_prefix(term).unwrap_or(name).trim_start_matches('_');
    if rest.is_empty() { name.replace('_', " ") } else { rest.replace('_', " ") }
}

fn line(name: String, colour: usize, dashed: bool, points: impl Iterator<Item = [f64; 2]>) -> DataSeries {
    DataSeries {
        name,
        colour,
        line: if dashed { LineStyle::Dashed } else { LineStyle::Thin },
        points: points.map(|[x, y]| DataPoint::new(x, y)).collect(),
        ..DataSeries::default()
    }
}

/// Marks at the beginnings of contact, hold and release.
fn phases(trial: &OpenTrial, origin: f64) -> Vec<ReferenceLine> {
    let marked = trial.phases.iter().filter(|span| span.phase != TouchPhase::PreShaping);
    let mark = |from_s: f64, phase: TouchPhase| ReferenceLine {
        horizontal: false,
        at: from_s - origin,
        text: phase.name().to_owned(),
    };
    marked.map(|span| mark(span.from_s, span.phase)).collect()
}

/// Heat maps of each trial, the left finger beside the right one.
fn heat_plots(trials: &[&OpenTrial], kind: HeatKind) -> Result<Vec<Plot>, FigureDataError> {
    let mut plots = Vec::new();
    // Pads of all trials are cut alike.
    let rows =
        |trial: &OpenTrial| touched_rows(&trial.header.scene.gripper, trial.frames.iter().map(std::ops::Deref::deref));
    let first = trials.iter().map(|trial| rows(trial).start).min().unwrap_or(0);
    for trial in trials {
        let simulated = trial.source == TrialSource::Simulated && !trial.frames.is_empty();
        if !simulated {
            return Err(lacking(trial, "simulated trials", kind.name()));
        }
        let gripper = &trial.header.scene.gripper;
        let maps: [HeatMap; 2] = match kind {
            HeatKind::Joints(unit) => joints_over_time(gripper, &trial.frames, unit),
            HeatKind::Pads(unit) => {
                let shown = first..gripper.taxels().rows;
                pad_rows_over_time(gripper, &trial.frames, unit, &shown)
            }
        };
        for map in maps {
            let title = if trials.len() == 1 {
                map.title.clone()
            } else {
                format!("{}, trial {}, {}", trial.title, trial.id, map.title)
            };
            plots.push(Plot { title, ..Plot::of_heat_map(map) });
        }
    }
    Ok(plots)
}

#[cfg(test)]
mod tests {
    use super::super::{Keep, OpenOptions};
    use super::*;
    use crate::grasping::grasp;
    use palpate_sim::scene::Scene;
    use palpate_store::Store;

    fn opened(objects: &[&str]) -> Vec<OpenTrial> {
        let folder = tempfile::tempdir().expect("a folder");
        let mut store = Store::open(&folder.path().join("trials.sqlite")).expect("opens");
        let options = OpenOptions { keep: Keep::Frames, sensors: SensorView::default(), ..OpenOptions::default() };
        let open = |object: &&str| {
            let mut scene = Scene::default();
            scene.object.source = (*object).to_owned();
            let model = scene.load_object().expect("built in");
            let id = store.insert(&grasp(&scene, model.as_ref(), 7)).expect("stored").id();
            OpenTrial::open(&store, id, &options).expect("opens")
        };
        objects.iter().map(open).collect()
    }

    #[test]
    fn a_title_tells_which_trials_are_shown() {
        let texts = [vec![25, 23, 24], vec![7, 3], vec![5, 5], (1..9).map(|k| 2 * k).collect()].map(trial_numbers);
        assert_eq!(texts, ["trials 23 to 25", "trials 3, 7", "trial 5", "trials 2, 4, 6, 8, 10, 12 …"]);
    }

    #[test]
    fn a_figure_of_one_trial_has_its_values_phases_and_origin() -> Result<(), FigureDataError> {
        let trials = opened(&["lemon"]);
        let one = &trials[0];
        let figure = comparison_figure(&[one], &FigureOptions::default())?;
        let titles: Vec<&str> = figure.plots.iter().map(|plot| plot.y.title.as_str()).collect();
        assert_eq!(titles, ["curvature (1/m)", "pressure (kPa)", "force (N)"]);
        let legend: Vec<&str> = figure.legend.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(legend, ["left", "right"], "one for three plots");
        let pressure = &figure.plots[1];
        assert_eq!(pressure.series.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), ["left", "right"]);
        assert_eq!(pressure.series.iter().map(|s| s.line).collect::<Vec<_>>(), [LineStyle::Thin, LineStyle::Dashed]);
        let column = one.column("pressure_left").expect("a column");
        for (point, (t_s, value)) in pressure.series[0].points.iter().zip(one.t_s.iter().zip(&column.values)) {
            let wanted = 1e-3 * f64::from(*value);
            assert_eq!(point.at[0], *t_s);
            assert!(point.at[1] == wanted || (point.at[1].is_nan() && wanted.is_nan()), "{} {wanted}", point.at[1]);
        }
        let marks: Vec<&str> = pressure.references.iter().map(|line| line.text.as_str()).collect();
        assert_eq!(marks, ["contact", "hold", "release"]);
        let hash = scene_hash(&one.header.scene);
        for part in ["Lemon: trial 1, simulated, seed 7, scene ", &hash, "Drawn by Palpate ", "sensors C1"] {
            assert!(figure.note.contains(part), "{part} in {}", figure.note);
        }
        Ok(())
    }

    #[test]
    fn trials_without_calibration_are_drawn_by_their_counts_and_mixed_with_no_others() -> Result<(), FigureDataError> {
        let trials = opened(&["lemon"]);
        let mut counted = OpenTrial { id: 2, source: TrialSource::Recorded, ..trials[0].clone() };
        counted.columns.iter_mut().flat_map(|column| &mut column.values).for_each(|value| *value = f32::NAN);
        assert!(counted.has_counts_alone() && !trials[0].has_counts_alone());
        let values = vec![512.0; counted.t_s.len()];
        counted.columns.push(Column { name: "pad_left".to_owned(), channel: None, unit: "counts", values });
        let figure = comparison_figure(&[&counted], &FigureOptions::default())?;
        assert_eq!(figure.plots.iter().map(|plot| plot.y.title.as_str()).collect::<Vec<_>>(), ["pad (counts)"]);
        let refused = |trials: [&OpenTrial; 2]| {
            comparison_figure(&trials, &FigureOptions::default()).expect_err("other channels").to_string()
        };
        let said = refused([&trials[0], &counted]);
        assert!(said.starts_with("trial 2 (not calibrated) has no channel \"curvature\"; it has pad_left"), "{said}");
        let said = refused([&counted, &trials[0]]);
        assert!(said.starts_with("trial 1 has no channel \"pad\""), "{said}");
        Ok(())
    }

    #[test]
    fn trials_are_aligned_at_contact_and_averaged_by_class() -> Result<(), FigureDataError> {
        let trials = opened(&["lemon", "lemon", "ball"]);
        let trials: Vec<&OpenTrial> = trials.iter().collect();
        let options = FigureOptions {
            channels: vec!["pressure".to_owned()],
            align: Alignment::Contact,
            ..FigureOptions::default()
        };
        let figure = comparison_figure(&trials, &options)?;
        let series = &figure.plots[0].series;
        assert_eq!(series.len(), 6);
        assert_eq!((series[0].colour, series[1].colour, series[4].colour), (0, 0, 2));
        let contact = trials[2].phase_from(TouchPhase::Contact).expect("it touched");
        assert!((series[4].points[0].at[0] - (trials[2].t_s[0] - contact)).abs() < 1e-12);
        let named = |figure: &Figure| figure.legend.iter().map(|s| (s.name.clone(), s.line)).collect::<Vec<_>>();
        let legend = named(&figure);
        assert_eq!(legend.len(), 5, "three trials and two line styles");
        assert_eq!(legend[0], (series[0].name.clone(), LineStyle::Thin));
        assert_eq!(legend[3..], [("left finger".into(), LineStyle::Thin), ("right finger".into(), LineStyle::Dashed)]);
        let mean = comparison_figure(&trials, &FigureOptions { mean: true, ..options.clone() })?;
        let plot = &mean.plots[0];
        assert_eq!((plot.series.len(), plot.bands.len()), (4, 4));
        assert_eq!(plot.series[0].name, "Lemon (n = 2)");
        // Two equal trials have no spread.
        assert!(plot.bands[0].points.iter().all(|[_, low, high]| high.is_nan() || high - low <= 1e-9));
        // Colours of the window: the second trial was pinned before the third, which it no longer is beside.
        let colours = vec![SHOWN_SERIES, 4, 1];
        let coloured = comparison_figure(&trials, &FigureOptions { colours: colours.clone(), ..options.clone() })?;
        let of = |figure: &Figure| figure.plots[0].series.iter().map(|s| s.colour).collect::<Vec<_>>();
        assert_eq!(of(&coloured), [SHOWN_SERIES, SHOWN_SERIES, 4, 4, 1, 1]);
        let coloured = comparison_figure(&trials, &FigureOptions { mean: true, colours, ..options.clone() })?;
        assert_eq!(of(&coloured), [4, 4, 1, 1], "the class has the colour of its first compared trial");
        let unknown = FigureOptions { channels: vec!["warmth".to_owned()], ..options };
        let error = comparison_figure(&trials, &unknown).expect_err("no such channel").to_string();
        assert!(error.contains("\"warmth\"; it has curvature_left, "), "{error}");
        assert!(comparison_figure(&[], &FigureOptions::default()).is_err());
        Ok(())
    }

    #[test]
    fn heat_maps_stand_side_by_side() -> Result<(), FigureDataError> {
        let trials = opened(&["ball"]);
        let kinds = [BendUnit::Angle, BendUnit::Curvature].map(HeatKind::Joints);
        for kind in kinds.into_iter().chain([HeatKind::Pads(LoadUnit::Pressure)]) {
            let options = FigureOptions { heat: Some(kind), ..FigureOptions::default() };
            let figure = comparison_figure(&[&trials[0]], &options)?;
            assert_eq!((figure.plots.len(), figure.columns), (2, 2));
            let heat = figure.plots[1].heat.as_ref().expect("cells");
            assert_eq!((heat.x.count, heat.title.as_str()), (trials[0].frames.len(), "right"));
            assert!(heat.values.iter().any(|value| *value > 1.0));
        }
        Ok(())
    }
}
