//! Sentences about the evidence.

use super::occlusion::{Attribution, Evidence};
use crate::inspection::{PhaseSpan, TouchPhase};
use palpate_geometry::units::{percent, true_minus};
use palpate_sim::objects::object_title;
use palpate_tactile::{Quantity, unit_of_channel};

/// How evidence is measured, in one sentence.
pub const MEASURED_HOW: &str = "How much the answer's probability drops when this part is replaced by an average \
     (percentage points; they overlap).";

/// Evidence below this is not worth a sentence (percent points).
const WORTH_NAMING: f64 = 1.0;
/// Most parts named for or against.
const MOST_NAMED: usize = 3;

/// Part of a grasp and its evidence.
#[derive(Clone, Debug, PartialEq)]
pub struct Reason {
    /// The part: `left pad pressure in the hold`.
    pub part: String,
    /// Its evidence.
    pub evidence: Evidence,
}

impl Attribution {
    /// Answer in one sentence: `Lemon 91 %, then Tomato 6 %.`
    pub fn answer(&self) -> String {
        let [first, second] = [&self.first, &self.second]
            .map(|class| format!("{} {}", object_title(&class.name), percent(class.probability)));
        format!("{first}, then {second}.")
    }

    /// Strongest reasons for and against the first class, strongest first: channels in a phase or, where none of these
    /// counts alone, whole channels or whole phases.
    pub fn reasons(&self) -> [Vec<Reason>; 2] {
        let both =
            self.by_both.iter().enumerate().flat_map(|(c, row)| {
                row.iter().enumerate().map(move |(p, evidence)| (self.part_words(c, p), *evidence))
            });
        let channels = self.by_channel.iter().enumerate();
        let channels =
            channels.map(|(c, evidence)| (format!("{} throughout", channel_words(&self.channels[c])), *evidence));
        let phases = self.by_phase.iter().zip(&self.phases);
        let phases = phases.map(|(evidence, span)| (format!("all channels {}", phase_words(span)), *evidence));
        let levels: [Vec<(String, Evidence)>; 3] = [both.collect(), channels.collect(), phases.collect()];
        [1.0, -1.0].map(|sign: f64| {
            let of_level = |parts: &Vec<(String, Evidence)>| strongest(parts, sign);
            levels.iter().map(of_level).find(|found| !found.is_empty()).unwrap_or_default()
        })
    }

    /// A channel in a phase: `left pad pressure in the hold`; where the pad touches nothing then, its silence is what spoke:
    /// `no left pad pressure yet while pre-shaping`.
    fn part_words(&self, channel: usize, phase: usize) -> String {
        let (name, span) = (channel_words(&self.channels[channel]), &self.phases[phase]);
        let still_closing = span.phase < TouchPhase::Hold;
        match (self.unloaded[channel][phase], name.split_once(", ")) {
            (false, _) => format!("{name} {}", phase_words(span)),
            (true, Some((pad, place))) if still_closing => format!("no {pad} ({place}) yet {}", phase_words(span)),
            (true, None) if still_closing => format!("no {name} yet {}", phase_words(span)),
            (true, _) => format!("no {name} {}", phase_words(span)),
        }
    }

    /// The strongest reason for the first class, or that there is no single one.
    pub fn because(&self) -> String {
        let [spoke_for, _] = self.reasons();
        spoke_for.into_iter().next().map_or_else(|| "no single part decides".to_owned(), |reason| reason.part)
    }

    /// Reasons in sentences: what spoke for the first class, and what against it.
    pub fn sentences(&self) -> Vec<String> {
        let title = object_title(&self.first.name);
        let [spoke_for, against] = self.reasons();
        let listed = |reasons: &[Reason]| -> String {
            let parts: Vec<String> = reasons
                .iter()
                .enumerate()
                .map(|(k, reason)| {
                    let unit = if k == 0 { " percentage points" } else { "" };
                    format!("{} ({}{unit})", reason.part, points_words(reason.evidence.points))
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

fn strongest(parts: &[(String, Evidence)], sign: f64) -> Vec<Reason> {
    let strong = parts.iter().filter(|(_, evidence)| sign * evidence.points >= WORTH_NAMING);
    let mut found: Vec<Reason> =
        strong.map(|(part, evidence)| Reason { part: part.clone(), evidence: *evidence }).collect();
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

/// Percent points with their sign: `+38`, `−0.4`; `0` for none.
pub fn points_words(points: f64) -> String {
    true_minus(&match points.abs() {
        size if size < 0.05 => "0".to_owned(),
        size if size < 0.95 => format!("{points:+.1}"),
        _ => format!("{points:+.0}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::why::occlusion::ClassShare;

    fn evidence(points: f64) -> Evidence {
        Evidence { points, decibans: points }
    }

    fn found(by_both: [[f64; 2]; 2]) -> Attribution {
        let share = |class, name: &str, probability| ClassShare { class, name: name.to_owned(), probability };
        let span = |phase| PhaseSpan { phase, from_s: 0.0, to_s: 1.0 };
        let row = |cells: [f64; 2]| cells.map(evidence).to_vec();
        Attribution {
            first: share(0, "lemon", 0.912),
            second: share(1, "tomato", 0.06),
            channels: ["pressure_left", "curvature_right_distal"].map(str::to_owned).to_vec(),
            phases: [TouchPhase::Contact, TouchPhase::Hold].map(span).to_vec(),
            by_channel: [0.4, 0.2].map(evidence).to_vec(),
            by_phase: [0.0, 0.3].map(evidence).to_vec(),
            by_both: by_both.map(row).to_vec(),
            unloaded: vec![vec![false; 2]; 2],
            grasps: Vec::new(),
            calls: 9,
        }
    }

    #[test]
    fn the_sentences_name_the_strongest_parts() {
        let why = found([[12.2, 38.0], [-9.0, 0.3]]);
        assert_eq!(why.answer(), "Lemon 91 %, then Tomato 6 %.");
        assert_eq!(
            why.sentences(),
            [
                "For Lemon: left pad pressure in the hold (+38 percentage points), left pad pressure in contact (+12).",
                "Against Lemon: right curvature, distal in contact (−9 percentage points)."
            ]
        );
        // A pad without load speaks by its silence.
        let silent = |unloaded: [bool; 2]| {
            let cells = vec![unloaded.to_vec(), vec![false; 2]];
            Attribution { unloaded: cells, ..found([[96.0, 0.0], [0.0, 0.0]]) }.because()
        };
        assert_eq!(silent([true, false]), "no left pad pressure yet in contact");
        let let_go = Attribution { unloaded: vec![vec![false, true]; 2], ..found([[0.0, 12.0], [0.0; 2]]) };
        assert_eq!(let_go.because(), "no left pad pressure in the hold");
        // No part alone changes the answer by a point.
        let sure = found([[0.1; 2]; 2]);
        assert_eq!(
            sure.sentences()[0],
            "No single part decides: without any one of them Lemon still has 90 % or more."
        );
        assert_eq!(sure.sentences()[1], "Nothing spoke against it by a percentage point or more.");
        // A whole phase does, although no channel in it does alone.
        let together = Attribution { by_phase: [0.0, 44.0].map(evidence).to_vec(), ..sure };
        assert_eq!(together.sentences()[0], "For Lemon: all channels in the hold (+44 percentage points).");
    }

    #[test]
    fn channels_and_points_are_in_words() {
        let names = ["force_right", "pressure_left_pair_1", "contact_pressure_left", "grip", "my_own_sensor"];
        let words = ["right pad force", "left pad pressure, pair 1", "left contact pressure", "grip", "my own sensor"];
        assert_eq!(names.map(channel_words), words);
        assert_eq!([0.01, 0.31, -0.4, 12.4, -7.6].map(points_words), ["0", "+0.3", "−0.4", "+12", "−8"]);
    }
}
