//! `palpate replay`: plays a stored trial or captured bytes as the live gripper: rows and recognition.

use super::prelude::*;
use super::recognise::{StageOne, load_model, named, shipped_for, warn_of_perfect_sensors};
use palpate_device::serial::{LinkOptions, SerialLink};
use palpate_geometry::units::percent;
use palpate_lab::grasping::{Identification, Row};
use palpate_lab::gripper::SerialGripper;
use palpate_lab::recording::Replay;
use palpate_learn::Shipped;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Arguments of `palpate replay`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate replay 1
  palpate replay 1 --speed 0 > rows.csv
  palpate replay grasp.bytes --model mine.safetensors --json

See also: palpate help store")]
pub(super) struct ReplayArguments {
    /// Number of a stored trial, or file of captured bytes.
    #[arg(value_name = "TRIAL|FILE")]
    source: PathBuf,
    /// Recognition model (default: the shipped one for free or fixed objects, or for any real gripper).
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Speed, as a multiple of the original; 0: as fast as possible.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    speed: f64,
    /// Print one JSON object instead of text, as fast as possible.
    #[arg(long)]
    json: bool,
}

/// One row, with the most likely class so far.
#[derive(Serialize)]
struct RowReport {
    t_s: f64,
    line_bar: Option<f64>,
    phase: Option<&'static str>,
    values: BTreeMap<String, Option<f32>>,
    class: Option<String>,
    probability: Option<f64>,
}

/// Output of `--json`.
#[derive(Serialize)]
struct Report {
    rows: Vec<RowReport>,
    /// Most likely class of the last grasp.
    decided: Option<String>,
    stage_one: Option<StageOne>,
    pmf: BTreeMap<String, f64>,
    /// Reason why nothing was recognised.
    not_recognised: Option<String>,
}

pub(super) fn run(arguments: &ReplayArguments, store: Option<&Path>) -> Result<(), Failure> {
    let model = |shipped| Ok::<_, Failure>(Some(Arc::new(load_model(arguments.model.as_deref(), shipped)?)));
    let trial: Option<TrialId> = arguments.source.to_str().and_then(|text| text.parse().ok());
    let mut replay = match trial {
        Some(id) => {
            let store = read_store(store)?;
            Replay::of_trial(&store, id, model(shipped_for(&store, &[id])?)?)?
        }
        None => {
            let replay_speed = f64::INFINITY;
            let options = LinkOptions {
                path: Some(arguments.source.clone()),
                replay_speed,
                sensors: sensors(store)?,
                ..LinkOptions::default()
            };
            if !arguments.source.is_file() {
                let name = arguments.source.display();
                return Err(format!("\"{name}\" is neither the number of a trial nor a file of captured bytes").into());
            }
            let gripper = SerialGripper::new(Box::new(SerialLink::open(&options)?));
            Replay::of_capture(gripper, existing_store(store)?.as_ref(), model(Shipped::AnyGripper)?)?
        }
    };
    let (mut rows, mut header, mut pace, mut count, mut unlike) = (Vec::new(), Vec::new(), None, 0, false);
    while let Some(row) = replay.next_row()? {
        count += 1;
        if let Some(text) = replay.identification().and_then(Identification::unlike_at_start).filter(|_| !unlike) {
            unlike = true;
            warn(&text);
        }
        let answer = answer(&replay);
        if arguments.json {
            rows.push(report(&replay, &row, answer));
            continue;
        }
        let (began, first_s) = *pace.get_or_insert((Instant::now(), row.t_s));
        let due = Duration::try_from_secs_f64((row.t_s - first_s) / arguments.speed).unwrap_or_default();
        std::thread::sleep(due.saturating_sub(began.elapsed()));
        if header != replay.channels() {
            header = replay.channels().to_vec();
            say(format!("t_s,line_pressure [bar],phase,{},class,probability", header.join(",")))?;
        }
        print(&row, answer)?;
    }
    let identification = replay.identification();
    let verdict = identification.and_then(Identification::verdict);
    let not_recognised = match (verdict, replay.why_off()) {
        (Some(_), _) => None,
        (None, Some(cause)) => Some(cause.to_string()),
        (None, None) => Some("no grasp was found".to_owned()),
    };
    let decided = answer(&replay);
    if let Some(own) = identification.filter(|_| decided.is_some() && replay.is_of_board()) {
        warn_of_perfect_sensors(own.model());
    }
    let cut_short = replay.cut_short().map(|cause| format!("the replay ended early, after {count} readings: {cause}"));
    if count == 0 && trial.is_none() {
        let no_board =
            || format!("\"{}\" has no reading: it should hold bytes as a board sent them", arguments.source.display());
        return Err(cut_short.unwrap_or_else(no_board).into());
    }
    if arguments.json {
        let model = identification.map(Identification::model);
        say_json(&Report {
            rows,
            decided: decided.map(|(class, _)| class),
            stage_one: verdict.zip(model).and_then(|(verdict, model)| StageOne::of(verdict, &model.card.labels)),
            pmf: verdict.zip(model).map(|(verdict, model)| named(model, &verdict.pmf)).unwrap_or_default(),
            not_recognised,
        })?;
    } else {
        match (decided, not_recognised) {
            (Some((class, p)), None) => note(&format!("recognised as {class} ({})", percent(p))),
            (_, cause) => note(&format!("no recognition: {}", cause.unwrap_or_default())),
        }
    }
    cut_short.map_or(Ok(()), |cause| Err(cause.into()))
}

/// The most likely class of the running or last grasp.
fn answer(replay: &Replay) -> Option<(String, f64)> {
    let identification = replay.identification()?;
    let (class, probability) = identification.verdict()?.pmf.top();
    Some((identification.model().card.labels.classes[class].name.clone(), probability))
}

fn report(replay: &Replay, row: &Row, answer: Option<(String, f64)>) -> RowReport {
    let values = row.values.iter().map(|value| Some(*value).filter(|value| value.is_finite()));
    let (class, probability) = answer.unzip();
    RowReport {
        t_s: row.t_s,
        line_bar: Some(row.line_bar).filter(|bar| bar.is_finite()),
        phase: row.phase.map(|phase| phase.name()),
        values: replay.channels().iter().cloned().zip(values).collect(),
        class,
        probability,
    }
}

fn print(row: &Row, answer: Option<(String, f64)>) -> Result<(), Failure> {
    let number = |value: f64| if value.is_finite() { value.to_string() } else { String::new() };
    let mut cells = vec![number(row.t_s), number(row.line_bar), row.phase.map_or("", |phase| phase.name()).to_owned()];
    cells.extend(row.values.iter().map(|value| if value.is_finite() { value.to_string() } else { String::new() }));
    let (class, probability) = answer.map_or_else(Default::default, |(class, p)| (class, format!("{p:.3}")));
    cells.extend([class, probability]);
    say(cells.join(","))
}
