//! Sentences about the evidence.

use super::occlusion::{Attribution, Evidence};
use crate::inspection::{PhaseSpan, TouchPhase};
use palpate_geometry::units::{percent, true_minus};
use palpate_sim::objects::capital_title;
use palpate_tactile::{Quantity, unit_of_channel};

/// How evidence is measured, in one sentence.
pub const MEASURED_HOW: &str = "How much the answer's probability drops when this part is replaced by an average \
     (percentage points). They do not add up: without a whole row or column the model looks at the rest.";

/// Evidence below this is not worth a sentence (percent points).
const WORTH_NAMING: f64 = 1.0;
/// Most parts named for or against.
const MOST_NAMED: usize = 3;

/// Part of a grasp and its evidence.
#[derive(Clone, Debug, PartialEq)]
pub struct Reason {
    /// The part: `left pad pressure`.
    pub part: String,
    /// Phase that has more than half of it: `in the hold`.
    pub mostly: Option<&'static str>,
    /// Its evidence.
    pub evidence: Evidence,
}

/// Times the evidence of a phase is that of the strongest channel where channels count together only.
const TOGETHER: f64 = 4.0;

impl Attribution {
    /// Answer in one sentence: `Lemon 91 %, then Tomato 6 %.` A second class below 1 % is left out.
    pub fn answer(&self) -> String {
        let [first, second] = [&self.first, &self.second]
            .map(|class| format!("{} {}", capital_title(&class.name), percent(class.probability)));
        if self.second.probability < 0.01 { format!("{first}.") } else { format!("{first}, then {second}.") }
    }

    /// Strongest reasons for and against the first class, strongest first: channels, each with the phase in which it speaks
    /// most, or, where channels count together only, whole phases.
    pub fn reasons(&self) -> [Vec<Reason>; 2] {
        let channels: Vec<Reason> = (0..self.channels.len()).map(|channel| self.channel_reason(channel)).collect();
        let of_phase = |(own, span): (&Evidence, &PhaseSpan)| Reason {
            part: format!("all channels {}", phase_words(span)),
            mostly: None,
            evidence: *own,
        };
        // A phase whose channels speak the other way, one by one, is no reason.
        let is_clear = |phase: usize| {
            let opposed =
                |both: &Evidence| both.points * self.by_phase[phase].points < 0.0 && both.points.abs() >= WORTH_NAMING;
            !self.by_both.iter().any(|own| opposed(&own[phase]))
        };
        let phases = self.by_phase.iter().zip(&self.phases).enumerate().filter(|(phase, _)| is_clear(*phase));
        let phases: Vec<Reason> = phases.map(|(_, own)| of_phase(own)).collect();
        [1.0, -1.0].map(|sign: f64| {
            let [found, together] = [&channels, &phases].map(|parts| strongest(parts, sign));
            let most = |parts: &[Reason]| parts.first().map_or(0.0, |part| sign * part.evidence.points);
            if most(&together) > TOGETHER * most(&found) { together } else { found }
        })
    }

    /// A channel; where its pad touches nothing in the phase that has most of it, its silence spoke: `late left pad pressure`,
    /// or `no left pad pressure` where it touches nothing later either.
    fn channel_reason(&self, channel: usize) -> Reason {
        let evidence = self.by_channel[channel];
        let most = self.by_both[channel].iter().position(|both| both.points / evidence.points > 0.5);
        let name = channel_words(&self.channels[channel]);
        let part = match most {
            Some(phase) if self.unloaded[channel][phase] => {
                let late = self.unloaded[channel][phase..].contains(&false);
                format!("{} {name}", if late { "late" } else { "no" })
            }
            _ => name,
        };
        Reason { part, mostly: most.map(|phase| phase_words(&self.phases[phase])), evidence }
    }

    /// The strongest reason for the first class in few words, without its phase, or that there is no single one.
    pub fn because(&self) -> String {
        let [spoke_for, _] = self.reasons();
        spoke_for.into_iter().next().map_or_else(|| "no single part decides".to_owned(), |reason| reason.part)
    }

    /// Reasons in sentences: what spoke for the first class, and what against it.
    pub fn sentences(&self) -> Vec<String> {
        let title = capital_title(&self.first.name);
        let [spoke_for, against] = self.reasons();
        let listed = |reasons: &[Reason]| -> String {
            let parts: Vec<String> = reasons
                .iter()
                .enumerate()
                .map(|(k, reason)| {
                    let unit = if k == 0 { " percentage points" } else { "" };
                    let mostly = reason.mostly.map(|phase| format!(", mostly {phase}")).unwrap_or_default();
                    format!("{}{mostly} ({}{unit})", reason.part, points_words(reason.evidence.points))
                })
                .collect();
            parts.join(", ")
        };
        let for_it = if spoke_for.is_empty() {
            let parts = self.by_channel.iter().chain(&self.by_phase);
            let most = parts.map(|evidence| evidence.points).fold(0.0, f64::max);
            let left = percent((self.first.probability - most / 100.0).max(0.0));
            format!("No single part decides: without any one of them {title} still has {left} or more.")
        } else {
            format!("For {title}: {}.", listed(&spoke_for))
        };
        let against_it = if against.is_empty() {
            "Nothing spoke against it by a percentage point or more.".to_owned()
        } else {
            format!("Against {title}: {}.", listed(&against))
        };
        vec![for_it, against_it]
    }
}

fn strongest(parts: &[Reason], sign: f64) -> Vec<Reason> {
    let strong = parts.iter().filter(|part| sign * part.evidence.points >= WORTH_NAMING);
    let mut found: Vec<Reason> = strong.cloned().collect();
    found.sort_by(|a, b| (sign * b.evidence.points).total_cmp(&(sign * a.evidence.points)));
    found.truncate(MOST_NAMED);
    found
}

/// Where a phase is, in a sentence: `in the hold`.
fn phase_words(span: &PhaseSpan) -> &'static str {
    match span.phase {
        TouchPhase::PreShaping => "while pre-shaping",
        TouchPhase::Contact => "in contact",
        TouchPhase::Hold => "in the hold",
        TouchPhase::Release => "in the release",
    }
}

/// A channel in words: `left pad pressure, distal` for `pressure_left_distal`.
pub fn channel_words(name: &str) -> String {
    let Some((quantity, place)) = Quantity::of_name(name) else { return unit_of_channel(name).0.replace('_', " ") };
    let quantity = match quantity {
        Quantity::Curvature => "curvature",
        Quantity::Pressure => "pad pressure",
        Quantity::ContactPressure => "contact pressure",
        Quantity::Force => "pad force",
        Quantity::Raw { .. } => "reading",
    };
    match place.split_once('_') {
        None => format!("{place} {quantity}"),
        Some((side, span)) => format!("{side} {quantity}, {}", span.replace('_', " ")),
    }
}

/// Percent points with their sign: `+38`, `−0.4`; `0` for none. Rounded towards zero as probabilities are: none loses more
/// than it has.
pub fn points_words(points: f64) -> String {
    true_minus(&match points.abs() {
        size if size < 0.05 => "0".to_owned(),
        size if size < 0.95 => format!("{points:+.1}"),
        _ => format!("{:+.0}", (points + 0.05 * points.signum()).trunc()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::why::occlusion::ClassShare;

    fn evidence(points: f64) -> Evidence {
        Evidence { points, decibans: points }
    }

    /// What two channels say over the grasp, and in each phase.
    fn found(by_channel: [f64; 2], by_both: [[f64; 2]; 2]) -> Attribution {
        let share = |class, name: &str, probability| ClassShare { class, name: name.to_owned(), probability };
        let span = |phase| PhaseSpan { phase, from_s: 0.0, to_s: 1.0 };
        let row = |cells: [f64; 2]| cells.map(evidence).to_vec();
        Attribution {
            first: share(0, "lemon", 0.912),
            second: share(1, "tomato", 0.06),
            channels: ["pressure_left", "curvature_right_distal"].map(str::to_owned).to_vec(),
            phases: [TouchPhase::Contact, TouchPhase::Hold].map(span).to_vec(),
            by_channel: by_channel.map(evidence).to_vec(),
            by_phase: [0.0, 0.3].map(evidence).to_vec(),
            by_both: by_both.map(row).to_vec(),
            unloaded: vec![vec![false; 2]; 2],
            grasps: Vec::new(),
            calls: 9,
        }
    }

    #[test]
    fn the_sentences_name_the_strongest_parts() {
        let why = found([40.2, -9.0], [[12.2, 38.0], [-9.0, 0.3]]);
        assert_eq!(why.answer(), "Lemon 91 %, then Tomato 6 %.");
        assert_eq!(
            why.sentences(),
            [
                "For Lemon: left pad pressure, mostly in the hold (+40 percentage points).",
                "Against Lemon: right curvature, distal, mostly in contact (−9 percentage points)."
            ]
        );
        // A phase is no reason where its channels speak the other way, one by one.
        let against = |cell: f64| {
            let found = found([0.0, 0.0], [[0.0, cell], [0.0, 0.0]]);
            Attribution { by_phase: [0.0, -2.0].map(evidence).to_vec(), ..found }.reasons()[1].len()
        };
        assert_eq!([against(0.0), against(16.0)], [1, 0]);
        // A pad without load speaks by its silence.
        let silent = |unloaded: [bool; 2]| {
            let cells = vec![unloaded.to_vec(), vec![false; 2]];
            Attribution { unloaded: cells, ..found([60.0, 0.0], [[96.0, 0.0], [0.0, 0.0]]) }.because()
        };
        assert_eq!(silent([true, false]), "late left pad pressure");
        assert_eq!(silent([true, true]), "no left pad pressure");
        assert_eq!(silent([false, true]), "left pad pressure");
        let let_go =
            Attribution { unloaded: vec![vec![false, true]; 2], ..found([12.0, 0.0], [[0.0, 12.0], [0.0; 2]]) };
        assert_eq!(let_go.because(), "no left pad pressure");
        assert_eq!(let_go.reasons()[0][0].mostly, Some("in the hold"));
        // Where no phase has more than half, none is named.
        assert_eq!(found([12.0, 0.0], [[0.2; 2]; 2]).because(), "left pad pressure");
        // Neither a channel nor a phase changes the answer by a point; a channel in one phase would, beside its others.
        let sure = found([0.4, 0.2], [[90.0, 0.1], [0.1; 2]]);
        assert_eq!(
            sure.sentences()[0],
            "No single part decides: without any one of them Lemon still has 90 % or more."
        );
        assert_eq!(sure.sentences()[1], "Nothing spoke against it by a percentage point or more.");
        // A whole phase does, although no channel in it does alone.
        let together = Attribution { by_phase: [0.0, 44.0].map(evidence).to_vec(), ..sure };
        assert_eq!(together.sentences()[0], "For Lemon: all channels in the hold (+44 percentage points).");
        // Channels that say the same lose little alone.
        let same = Attribution { by_channel: [2.0, 1.0].map(evidence).to_vec(), ..together };
        assert_eq!(same.because(), "all channels in the hold");
    }

    #[test]
    fn channels_and_points_are_in_words() {
        let names = ["force_right", "pressure_left_pair_1", "contact_pressure_left", "grip", "my_own_sensor"];
        let words = ["right pad force", "left pad pressure, pair 1", "left contact pressure", "grip", "my own sensor"];
        assert_eq!(names.map(channel_words), words);
        assert_eq!([0.01, 0.31, -0.4, 12.4, -7.6].map(points_words), ["0", "+0.3", "−0.4", "+12", "−7"]);
    }
}
