//! `palpate recognise`: recognises the objects of stored trials, one by one or all together.

mod why;

use super::prelude::*;
use palpate_geometry::units::percent;
use palpate_lab::datasets::{DatasetQuery, SensorView};
use palpate_learn::{Belief, Labels, Model, Pmf, Shipped, Verdict};
use palpate_store::TrialRow;
use palpate_store::labels::shown_title;
use palpate_tactile::trial::TrialSource;
use std::collections::{BTreeMap, BTreeSet};
use why::{Explanations, WhyReport};

/// Arguments of `palpate recognise`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate recognise 1
  palpate recognise 1 2 3 --together
  palpate recognise 1 --why
  palpate recognise 7 --model mine.safetensors --json")]
pub(super) struct RecogniseArguments {
    /// Trial numbers.
    #[arg(required = true)]
    trials: Vec<TrialId>,
    /// Recognition model (default: the shipped one for free or fixed objects, or for any real gripper).
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Treat the trials as grasps of one object, and also combine them.
    #[arg(long)]
    together: bool,
    /// Say what spoke for and against each answer, by channel and phase, and which stored trials are nearest.
    #[arg(long)]
    why: bool,
    /// Number of nearest stored trials with --why, among the newest 2000; 0 for none.
    #[arg(long, value_name = "COUNT", default_value_t = 3, requires = "why")]
    nearest: usize,
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
}

/// Result for one trial.
#[derive(Serialize)]
struct TrialReport {
    trial: TrialId,
    /// Label in the store; none for an unlabelled trial.
    truth: Option<String>,
    decided: String,
    probability: f64,
    stage_one: Option<StageOne>,
    pmf: BTreeMap<String, f64>,
    /// Classes that are left, of a model whose answers are calibrated.
    #[serde(skip_serializing_if = "Option::is_none")]
    left: Option<Vec<String>>,
    /// With `--why`.
    #[serde(skip_serializing_if = "Option::is_none")]
    why: Option<WhyReport>,
}

/// Size and shape.
#[derive(Serialize)]
pub(super) struct StageOne {
    pub(super) size: String,
    pub(super) size_probability: f64,
    pub(super) shape: String,
    pub(super) shape_probability: f64,
}

impl StageOne {
    /// Most likely size and shape; none where the model has no stage one.
    pub(super) fn of(verdict: &Verdict, labels: &Labels) -> Option<Self> {
        let properties = verdict.properties.as_ref()?;
        let ((size, size_probability), (shape, shape_probability)) = (properties.size.top(), properties.shape.top());
        let (size, shape) = (labels.sizes.get(size)?.clone(), labels.shapes.get(shape)?.clone());
        Some(Self { size, size_probability, shape, shape_probability })
    }
}

/// Output of `--json`.
#[derive(Serialize)]
struct RecogniseReport {
    trials: Vec<TrialReport>,
    /// All trials as grasps of one object.
    together: Option<Together>,
}

#[derive(Serialize)]
struct Together {
    decided: String,
    probability: f64,
    pmf: BTreeMap<String, f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    left: Option<Vec<String>>,
}

/// The classes that are left, in words: `lemon or tomato`.
pub(super) fn left_in_words(left: &[String]) -> String {
    let names: Vec<String> = left.iter().map(|name| shown_title(name)).collect();
    match names.as_slice() {
        [] => "none of the known objects".to_owned(),
        [only] => only.clone(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

/// Loads the named model, or the shipped one for a kind of sensors.
pub(super) fn load_model(path: Option<&Path>, shipped: Shipped) -> Result<Model, Failure> {
    Ok(match path {
        Some(path) => Model::load(path)?,
        None => shipped.model()?,
    })
}

/// The shipped model that reads stored trials: the one for any gripper where one of them is of a real gripper, the one for
/// fixed objects where all objects are fixed.
pub(super) fn shipped_for(store: &Store, trials: &[TrialId]) -> Result<Shipped, Failure> {
    let is_real = |row: &TrialRow| row.source == TrialSource::Recorded && trials.contains(&row.id);
    if store.list(false)?.iter().any(is_real) {
        return Ok(Shipped::AnyGripper);
    }
    let mut all_fixed = true;
    for id in trials {
        all_fixed &= store.load(*id)?.header.scene.holds_object();
    }
    Ok(Shipped::simulated(all_fixed))
}

/// Warns about a model from perfect sensors that answers readings of a real gripper.
pub(super) fn warn_of_perfect_sensors(model: &Model) {
    if model.card.learned_from_perfect_sensors() {
        warn(
            "the model knows perfect sensors only, so most of its answers to trials of a real gripper are wrong; after `palpate \
             adapt` leave --model out, or train one on your trials: palpate train --source serial",
        );
    }
}

/// Warns about a model that answers for fingers that it has not learned.
pub(super) fn warn_of_other_fingers() {
    warn(
        "the model has not learned these fingers, so most of its answers are wrong; train one on grasps by them: palpate \
         collect --scene FILE",
    );
}

/// Warns about a model from free objects that answers for a fixed one, or the other way round.
pub(super) fn warn_unless_learned(model: &Model, fixed: bool) {
    if model.card.data.fixed().is_some_and(|learned| learned != fixed) {
        let [own, other, option] = if fixed { ["fixed", "free", " --fixed"] } else { ["free", "fixed", ""] };
        warn(&format!(
            "the object is {own} and the model knows {other} objects only, so most of its answers are wrong; leave --model out, \
             or train one on {own} objects: palpate collect{option}"
        ));
    }
}

/// Probabilities by name, for JSON.
pub(super) fn named(model: &Model, pmf: &Pmf) -> BTreeMap<String, f64> {
    model.card.labels.classes.iter().map(|c| c.name.clone()).zip(pmf.probabilities().iter().copied()).collect()
}

pub(super) fn run(arguments: &RecogniseArguments, store: Option<&Path>) -> Result<(), Failure> {
    let store = read_store(store)?;
    let model = load_model(arguments.model.as_deref(), shipped_for(&store, &arguments.trials)?)?;
    let labels = &model.card.labels;
    let prior = model.card.prior();
    let mut belief = Belief::default();
    let mut trials = Vec::new();
    let mut is_real = false;
    let (mut fixed, mut has_fingers) = (BTreeSet::new(), true);
    let mut explanations = arguments.why.then(|| Explanations::new(&model, arguments.nearest));
    for id in &arguments.trials {
        let data = DatasetQuery::default().read_trial(&store, *id, &SensorView::of_model(&model.card))?;
        model.check_channels(&data.channels)?;
        is_real |= data.about.sensors.is_none();
        fixed.extend(data.about.fixed());
        let fingers = data.about.fingers.first().cloned().flatten();
        has_fingers &= model.card.knows_fingers(&fingers);
        let grasp = &data.examples[0].grasp;
        let after = |before: Option<&Pmf>| model.recogniser.recognise(grasp, before.or(prior.as_ref()));
        let alone = after(None);
        let with = belief.now().map_or_else(|| alone.pmf.clone(), |before| after(Some(before)).pmf);
        belief.add(with, alone.pmf.clone());
        let mut single = Belief::default();
        single.add(alone.pmf.clone(), alone.pmf.clone());
        let why = match &mut explanations {
            Some(explanations) => {
                let explained = if arguments.together { &belief } else { &single };
                Some(explanations.of(&store, *id, grasp, explained)?)
            }
            None => None,
        };
        let (class, probability) = alone.pmf.top();
        let stage_one = StageOne::of(&alone, labels);
        trials.push(TrialReport {
            trial: *id,
            truth: Some(data.labels.classes[0].name.clone()).filter(|name| !name.is_empty()),
            decided: labels.classes[class].name.clone(),
            probability,
            stage_one,
            pmf: named(&model, &alone.pmf),
            left: model.card.left(&single, Between::default().name()),
            why,
        });
    }
    let labelled: BTreeSet<&str> = trials.iter().filter_map(|trial| trial.truth.as_deref()).collect();
    if arguments.together && labelled.len() > 1 {
        let names: Vec<String> = labelled.into_iter().map(shown_title).collect();
        warn(&format!(
            "--together takes these trials for grasps of one object, but their labels are {}",
            names.join(", ")
        ));
    }
    let together = belief.now().filter(|_| arguments.together).map(|pmf| Together {
        decided: labels.classes[pmf.top().0].name.clone(),
        probability: pmf.top().1,
        pmf: named(&model, pmf),
        left: model.card.left(&belief, Between::default().name()),
    });
    if is_real {
        warn_of_perfect_sensors(&model);
    }
    if !has_fingers {
        warn_of_other_fingers();
    }
    fixed.into_iter().for_each(|fixed| warn_unless_learned(&model, fixed));
    RecogniseReport { trials, together }.print(arguments.json)
}

impl Report for RecogniseReport {
    fn text(&self, page: &mut Page) {
        // Many models have one stage only.
        let staged = self.trials.iter().any(|trial| trial.stage_one.is_some());
        let row = |trial: &TrialReport| {
            let properties = trial.stage_one.as_ref().map(|s| format!("{}, {}", s.size, s.shape));
            let truth = shown_title(trial.truth.as_deref().unwrap_or_default());
            let mut cells = vec![trial.trial.to_string(), truth];
            cells.extend(staged.then(|| properties.unwrap_or_default()));
            cells.extend([shown_title(&trial.decided), percent(trial.probability)]);
            cells
        };
        let stage = staged.then_some("stage one");
        let header: Vec<&str> =
            ["trial", "label"].into_iter().chain(stage).chain(["recognised as", "probability"]).collect();
        page.table(&header, self.trials.iter().map(row));
        for trial in &self.trials {
            trial
                .left
                .iter()
                .for_each(|left| page.line(format!("trial {}, left: {}", trial.trial, left_in_words(left))));
        }
        if let Some(all) = &self.together {
            page.line(format!("together: {} ({})", shown_title(&all.decided), percent(all.probability)));
            all.left.iter().for_each(|left| page.line(format!("left: {}", left_in_words(left))));
        }
        let explained = || self.trials.iter().filter_map(|trial| Some((trial.trial, trial.why.as_ref()?)));
        explained().for_each(|(id, why)| why.text(page, id, self.together.is_some()));
        explained().next_back().into_iter().for_each(|(_, why)| why.method_text(page));
    }
}
