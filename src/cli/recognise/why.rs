//! `palpate recognise --why`: what spoke for and against an answer, and the stored trials nearest to the grasp.

use super::super::prelude::*;
use palpate_lab::datasets::{SensorView, trial_signals};
use palpate_lab::grasping::RecognisedGrasp;
use palpate_lab::why::{
    Attribution, BeliefMove, ClassShare, Evidence, MEASURED_HOW, NearestQuery, NearestReport, TrialIndex,
    channel_words, explain, percent, points_words,
};
use palpate_learn::{Belief, Model, Sequence};
use palpate_sim::objects::object_title;
use palpate_store::labels::shown_name;
use std::sync::Arc;

/// Explains the answers to successive trials.
pub(super) struct Explanations {
    model: Arc<Model>,
    /// Nearest trials wanted.
    nearest: usize,
    index: TrialIndex,
}

/// Explanation of one answer.
#[derive(Serialize)]
pub(super) struct WhyReport {
    first: ClassShare,
    second: ClassShare,
    by_channel: Vec<PartReport>,
    by_phase: Vec<PartReport>,
    by_channel_and_phase: Vec<PartReport>,
    /// Course of the belief in first and second class over the grasps so far.
    grasps: Vec<BeliefMove>,
    /// Answers of the model that the evidence took.
    calls: usize,
    nearest: Option<NearestReport>,
    #[serde(skip)]
    found: Attribution,
}

/// Part of a grasp and its evidence.
#[derive(Serialize)]
struct PartReport {
    #[serde(skip_serializing_if = "Option::is_none")]
    channel: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    phase: Option<&'static str>,
    /// First time of the phase (s).
    #[serde(skip_serializing_if = "Option::is_none")]
    from_s: Option<f64>,
    #[serde(flatten)]
    evidence: Evidence,
}

impl Explanations {
    pub(super) fn new(model: &Model, nearest: usize) -> Self {
        Self { model: Arc::new(model.clone()), nearest, index: TrialIndex::default() }
    }

    /// Explains the answer to a trial after the belief that includes it.
    pub(super) fn of(
        &mut self,
        store: &Store,
        id: TrialId,
        grasp: &Sequence,
        belief: &Belief,
    ) -> Result<WhyReport, Failure> {
        let never = AtomicBool::new(false);
        let (model, view) = (Arc::clone(&self.model), SensorView::of_model(&self.model.card));
        let hold_s = trial_signals(store, id, store.load(id)?.source(), &view)?.hold_s;
        let found = explain(&RecognisedGrasp { model, grasp: grasp.clone(), hold_s, belief: belief.clone() }, &never)?;
        let signatures = self.model.signatures.clone().filter(|_| self.nearest > 0);
        let nearest = match signatures {
            Some(signatures) => {
                let query = NearestQuery { signatures, view, except: Some(id), count: self.nearest };
                self.index.nearest(store, grasp, &query, &never, &|_, _| ())?
            }
            None => None,
        };
        Ok(WhyReport::new(found, nearest))
    }
}

impl WhyReport {
    fn new(found: Attribution, nearest: Option<NearestReport>) -> Self {
        let part = |channel: Option<usize>, phase: Option<usize>, evidence: &Evidence| PartReport {
            channel: channel.map(|c| found.channels[c].clone()),
            phase: phase.map(|p| found.phases[p].phase.name()),
            from_s: phase.map(|p| found.phases[p].from_s),
            evidence: *evidence,
        };
        let both = found.by_both.iter().enumerate();
        let both = both.flat_map(|(c, row)| row.iter().enumerate().map(move |(p, own)| (c, p, own)));
        Self {
            first: found.first.clone(),
            second: found.second.clone(),
            by_channel: found.by_channel.iter().enumerate().map(|(c, own)| part(Some(c), None, own)).collect(),
            by_phase: found.by_phase.iter().enumerate().map(|(p, own)| part(None, Some(p), own)).collect(),
            by_channel_and_phase: both.map(|(c, p, own)| part(Some(c), Some(p), own)).collect(),
            grasps: found.grasps.clone(),
            calls: found.calls,
            nearest,
            found,
        }
    }

    /// Writes the explanation; `of_several` where the trials are grasps of one object.
    pub(super) fn text(&self, page: &mut Page, id: TrialId, of_several: bool) {
        page.line(format!("\ntrial {id}: {}", self.found.answer()));
        self.found.sentences().iter().for_each(|sentence| page.line(sentence));
        let title = object_title(&self.first.name);
        if let Some(last) = self.grasps.last().filter(|_| of_several) {
            let [before, alone, after] = [last.before, last.alone, last.after].map(|two| percent(two[0]));
            page.line(format!("{title}: {before} before this grasp, {alone} by it alone, {after} after it."));
        }
        let found = &self.found;
        let head = format!("points of {title}");
        let phases = found.phases.iter().map(|span| span.phase.name());
        let header: Vec<&str> = [head.as_str()].into_iter().chain(phases).chain(["whole grasp"]).collect();
        let points = |cells: &[Evidence]| cells.iter().map(|cell| points_words(cell.points)).collect::<Vec<_>>();
        let channels = found.channels.iter().zip(&found.by_both).zip(&found.by_channel);
        let rows = channels
            .map(|((name, cells), whole)| [vec![channel_words(name)], points(cells), points(&[*whole])].concat())
            .chain([[vec!["all channels".to_owned()], points(&found.by_phase), vec![String::new()]].concat()]);
        page.table(&header, rows);
        self.nearest.iter().for_each(|nearest| page.line(in_words(nearest)));
    }

    /// Says how evidence is measured.
    pub(super) fn method_text(&self, page: &mut Page) {
        page.line(format!("\nHow measured: {MEASURED_HOW} {} answers per grasp.", self.calls));
    }
}

/// The nearest trials in one sentence.
fn in_words(nearest: &NearestReport) -> String {
    let one = |trial: &palpate_lab::why::NearestTrial| {
        format!("{} {} ({:.2})", trial.id, shown_name(&trial.label), trial.distance)
    };
    let found: Vec<String> = nearest.trials.iter().map(one).collect();
    if found.is_empty() {
        return "Nearest stored trials: none with these channels.".to_owned();
    }
    let older = if nearest.older > 0 { format!(", {} older ones not", nearest.older) } else { String::new() };
    let (compared, found) = (nearest.compared, found.join(", "));
    format!("Nearest of {compared} stored trials{older}: {found}. Distance in spreads within a class.")
}
