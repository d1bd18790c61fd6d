//! The paper's studies: one subcommand for each, from the table of studies, and `all`.

use super::super::learning::QueryArguments;
use super::super::prelude::*;
use super::output::{BAR, StudyOutput, whole};
use clap::{ArgMatches, Args as _, Command, FromArgMatches, Subcommand};
use palpate_lab::datasets::DatasetQuery;
use palpate_study::paper::{PAPER_STUDIES, STUDY_PRESET, StudyData, StudyPlan, paper_study};
use palpate_study::{Measuring, StudyCard, StudyProgress, StudySize, StudyStep, cpu_cost};
use palpate_tactile::model::SensorModel;
use std::collections::BTreeMap;
use std::sync::atomic::AtomicUsize;

/// Arguments of every study of the paper.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct PaperArguments {
    /// Take less than a minute for each study: fewer grasps, small networks, few epochs.
    #[arg(long)]
    quick: bool,
    /// Sensor model of simulated grasps: virtual or physical-like (default: both; virtual for stored trials).
    #[arg(long, value_name = "MODEL", value_parser = one_of(SensorModel::ALL.map(|model| (model.name(), model))))]
    sensors: Option<SensorModel>,
    #[command(flatten)]
    trials: QueryArguments,
    /// Random seed of fits and splits.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    output: StudyOutput,
}

/// A study by its key, or all of them.
#[derive(Clone, Debug)]
pub(super) struct PaperCommand {
    /// None for all studies.
    key: Option<String>,
    arguments: PaperArguments,
}

const ALL: &str = "all";

/// Where the grasps of a study come from.
const GRASPS: &str =
    "Grasps: simulated, with --preset in the poses of that preset; any other filter reads stored trials.";

/// Subcommands, one for each study.
fn subcommands() -> Vec<Command> {
    let of = |name: &'static str, about: String, examples: String| {
        PaperArguments::augment_args(Command::new(name)).about(about).after_help(format!("{GRASPS}\n\n{examples}"))
    };
    let studies = PAPER_STUDIES.iter().map(|study| {
        let card = study.card();
        let (StudyCard { key, title, about, .. }, cost) = (card, card.cost());
        let examples = format!(
            "Cost: {cost}, with --quick at most a minute. Ctrl+C stops; the same command resumes.\n\nExamples:\n  palpate study \
             {key} --quick\n  palpate study {key} --out studies/\n  palpate study {key} --preset A --sensors physical-like\n  \
             palpate study {key} --source serial --json\n\nSee also: palpate help studies"
        );
        of(key, format!("{title} ({}): {about}.", study.card().origin()), examples)
    });
    let total = cpu_cost(PAPER_STUDIES.iter().filter_map(|study| study.card().cpu_hours()).sum());
    let examples = format!(
        "Cost: about {total}, with --quick a few minutes. Ctrl+C stops; the same command resumes.\n\nExamples:\n  palpate study all \
         --quick\n  palpate study all --out studies/\n\nSee also: palpate help studies"
    );
    let all = of(ALL, "Run all studies of the paper, one after the other.".to_owned(), examples);
    studies.chain([all]).collect()
}

impl FromArgMatches for PaperCommand {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let missing = || clap::Error::new(clap::error::ErrorKind::MissingSubcommand);
        let (name, own) = matches.subcommand().ok_or_else(missing)?;
        let key = (name != ALL).then(|| name.to_owned());
        Ok(Self { key, arguments: PaperArguments::from_arg_matches(own)? })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Subcommand for PaperCommand {
    fn augment_subcommands(command: Command) -> Command {
        command.subcommands(subcommands())
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        Self::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        name == ALL || paper_study(name).is_some()
    }
}

impl PaperArguments {
    fn plan(&self) -> StudyPlan {
        let size = if self.quick { StudySize::Quick } else { StudySize::Full };
        // A preset alone names poses to simulate; anything more asks for stored trials.
        let query = self.trials.query(false, None);
        let simulated = DatasetQuery { preset: query.preset.clone(), ..DatasetQuery::default() };
        let preset = query.preset.clone().map_or_else(|| STUDY_PRESET.to_owned(), |name| name.to_uppercase());
        let query = (query != simulated).then_some(query);
        let usual = StudyPlan::of_size(size);
        // Recorded trials have the sensors that they have.
        let sensors = match (self.sensors, &query) {
            (Some(sensors), _) => vec![sensors],
            (None, Some(_)) => vec![SensorModel::Virtual],
            (None, None) => usual.sensors.clone(),
        };
        StudyPlan { preset, sensors, query, seed: self.seed, ..usual }
    }
}

pub(super) fn run(command: &PaperCommand, store: Option<&Path>) -> Result<(), Failure> {
    let PaperCommand { key, arguments } = command;
    let studies = PAPER_STUDIES.iter().filter(|study| key.as_ref().is_none_or(|key| study.card().key == key));
    let (plan, output) = (arguments.plan(), &arguments.output);
    let folder = output.folder(arguments.quick);
    let (stop, bar) = (stop_flag()?, Progress::new(BAR));
    let (collected, wanted) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let progress = |StudyProgress { step, done, of }: StudyProgress| {
        bar.show(done, of);
        bar.0.set_message(if step == StudyStep::Collecting { "collecting grasps" } else { "measuring cells" });
        if step == StudyStep::Collecting {
            collected.store(done, Ordering::Relaxed);
            wanted.store(of, Ordering::Relaxed);
        }
    };
    let work = Measuring { threads: output.threads(), cancelled: &stop, progress: &progress };
    let store = open_store(store)?;
    let path = store.path().to_owned();
    let kept = || match [&collected, &wanted].map(|count| count.load(Ordering::Relaxed)) {
        [0, _] => String::new(),
        [done, of] => {
            format!(". {done} of {of} grasps simulated for it stay in {}; the next run uses them", path.display())
        }
    };
    let bench = StudyData::new(store, &plan, work);
    let mut reports = BTreeMap::new();
    for study in studies {
        let StudyCard { key, title, .. } = study.card();
        bar.0.reset();
        let part = folder.part(key, output.shard);
        let outcome = study.run(&bench, Some(&part), output.shard);
        bar.0.finish_and_clear();
        let Some(stored) = whole(key, &part, outcome?, &kept())? else { continue };
        let title = format!("{title} ({})", study.card().origin());
        let (shown, figures) = (&stored.result, study.figures(&stored.result));
        output.show(&folder, (key, &title, arguments.quick), &stored, shown, figures)?;
        reports.insert(key, stored);
    }
    match (key, reports.values().next()) {
        (_, None) => Ok(()),
        _ if !output.json => Ok(()),
        (Some(_), Some(only)) => say_json(only),
        _ => say_json(&reports),
    }
}
