//! `palpate plot`: figures of stored trials, as SVG or PNG.

use super::prelude::*;
use super::snapshot::sides_from;
use crate::app::ExportRequest;
use palpate_geometry::palette::Theme;
use palpate_lab::inspection::{Alignment, FigureOptions, HeatKind, Keep, OpenOptions, OpenTrial, comparison_figure};
use palpate_lab::picture::{BendUnit, LoadUnit};

/// Arguments of `palpate plot`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate plot 1 --out grasp.svg
  palpate plot 1 2 --channels pressure,line --align contact --out lemon_tomato.png
  palpate plot 1 2 3 4 --mean --channels curvature --out classes.svg
  palpate plot 1 --heat joints --out joints.svg

Each plot is one of --channels: the name of a channel (pressure_left), the beginning of names (pressure), or line.
See also: palpate trials list, palpate help sensors")]
pub(super) struct PlotArguments {
    /// Trial numbers.
    #[arg(required = true)]
    trials: Vec<TrialId>,
    /// Channels, one plot each (default: every quantity).
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    channels: Vec<String>,
    /// Common time of several trials: start or contact.
    #[arg(long, value_name = "NAME", default_value = "start", value_parser = one_of(Alignment::ALL.map(|align| (align.name(), align))))]
    align: Alignment,
    /// Mean and standard deviation of the trials of each object, in place of single trials.
    #[arg(long, conflicts_with = "heat")]
    mean: bool,
    /// Raw counts of the real gripper, in place of channels derived from them.
    #[arg(long, conflicts_with = "heat")]
    raw: bool,
    /// Heat maps over time: joints (angle of each) or pads (pressure on each row of taxels).
    #[arg(long, value_name = "NAME", value_parser = one_of([("joints", HeatKind::Joints(BendUnit::Angle)), ("pads", HeatKind::Pads(LoadUnit::Pressure))]))]
    heat: Option<HeatKind>,
    #[command(flatten)]
    signals: SignalArguments,
    /// Theme: dark or light.
    #[arg(long, value_name = "NAME", default_value = "light", value_parser = one_of(Theme::ALL.map(|theme| (theme.name(), theme))))]
    theme: Theme,
    /// Width and height in points; a PNG has two pixels per point (default: by the number of plots).
    #[arg(long, value_name = "WxH", value_parser = sides_from(16))]
    size: Option<[u32; 2]>,
    /// File to write: .svg or .png.
    #[arg(long, value_name = "FILE", value_parser = file_of(KINDS))]
    out: PathBuf,
}

/// Kinds of figures.
const KINDS: &[FileKind] = &[FileKind::Svg, FileKind::Png];

pub(super) fn run(arguments: &PlotArguments, store: Option<&Path>) -> Result<(), Failure> {
    let out = &arguments.out;
    check_new(out, FileKind::of(out, KINDS).unwrap_or(FileKind::Svg))?;
    arguments.signals.view().learnt()?;
    let store = read_store(store)?;
    let sensors = arguments.signals.of_store(arguments.signals.view(), &store)?;
    let options = OpenOptions {
        sensors,
        keep: if arguments.heat.is_some() { Keep::Frames } else { Keep::Channels },
        ..OpenOptions::default()
    };
    let open = |id: &TrialId| OpenTrial::open(&store, *id, &options);
    let trials = arguments.trials.iter().map(open).collect::<Result<Vec<OpenTrial>, _>>()?;
    let trials: Vec<&OpenTrial> = trials.iter().collect();
    let figure = comparison_figure(
        &trials,
        &FigureOptions {
            channels: arguments.channels.clone(),
            align: arguments.align,
            mean: arguments.mean,
            raw: arguments.raw,
            heat: arguments.heat,
            ..FigureOptions::default()
        },
    )?;
    let columns = figure.columns.max(1);
    let rows = figure.plots.len().div_ceil(columns).max(1);
    let size = arguments.size.unwrap_or([
        (420 * columns.max(2)).min(1260) as u32,
        (330 * rows + 40 + 15 * figure.note.lines().count()).min(2048) as u32,
    ]);
    let request = ExportRequest::Figure(figure, arguments.theme, size);
    request.write(out, &AtomicBool::new(false)).map_err(|cause| -> Failure { cause })?;
    say(out.display())
}
