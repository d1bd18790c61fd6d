//! What recognition has to say, in words. Nothing is drawn here.

use crate::app::panels::{Recognised, title_of};
use palpate_lab::grasping::IdentificationView;
use palpate_learn::{Labels, Pmf, StopReason};

/// Below this probability a first grasp that still goes on has no leader worth naming.
const WORTH_NAMING: f64 = 0.4;

/// What stands large at the top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Headline {
    /// Nothing has been felt yet.
    Waiting,
    /// Too early to say.
    Feeling,
    /// A class, by its index, and its probability; others may still overtake it.
    Leading(usize, f64),
    /// The class that was decided on, and its probability.
    Decided(usize, f64),
    /// It is none of the known classes.
    Unknown,
}

impl Headline {
    pub(super) fn of(view: &IdentificationView) -> Self {
        let Some((class, p)) = newest(view).map(Pmf::top) else { return Self::Waiting };
        match view.decision {
            Some(StopReason::Unknown) => Self::Unknown,
            Some(StopReason::Sure | StopReason::GraspLimit) => Self::Decided(class, p),
            None if view.listening && view.beliefs.is_empty() && p < WORTH_NAMING => Self::Feeling,
            None => Self::Leading(class, p),
        }
    }

    /// What it says, and how probable that is.
    pub(super) fn text(self, labels: &Labels) -> (String, Option<f64>) {
        match self {
            Self::Waiting => ("Ready".to_owned(), None),
            Self::Feeling => ("Feeling ..".to_owned(), None),
            Self::Unknown => ("Unknown".to_owned(), None),
            Self::Leading(class, p) | Self::Decided(class, p) => (title(labels, class), Some(p)),
        }
    }
}

/// What is believed at the moment: of the grasp that goes on or, before it says anything, after the one before.
pub(super) fn newest(view: &IdentificationView) -> Option<&Pmf> {
    view.verdict.as_ref().map(|verdict| &verdict.pmf).or(view.beliefs.last())
}

/// Why it goes on, or why it has stopped.
pub(super) fn reason(view: &IdentificationView, recognised: &Recognised<'_>) -> String {
    let (threshold, most) = (percent(view.rule.threshold), view.rule.most_grasps);
    let Some(now) = newest(view) else {
        let failed = "the grasp failed, so there is nothing to go by";
        return if recognised.finished { failed } else { recognised.waiting }.to_owned();
    };
    let p = now.top().1;
    let certain = p >= view.rule.threshold;
    let grasp = format!("grasp {} of at most {most}", view.beliefs.len() + 1);
    match view.decision {
        Some(StopReason::Sure) if certain => format!("{} reaches the threshold of {threshold}", percent(p)),
        Some(StopReason::Sure) => format!("{} reached the threshold that was set then", percent(p)),
        Some(StopReason::GraspLimit) => format!("grasp limit of {} reached, best guess", view.beliefs.len()),
        Some(StopReason::Unknown) => "the grasps agree on none of the known objects".to_owned(),
        None if view.listening => match view.beliefs.last() {
            Some(before) => format!("{grasp}; before it: {}", leaders(&view.labels, before)),
            None => format!("{grasp}; it is sure from {threshold} on"),
        },
        None if recognised.finished => format!("stopped before it was sure: {}", leaders(&view.labels, now)),
        None if certain && view.beliefs.len() == 1 => {
            format!("{}, but less sure than it is of what it knows: one more", percent(p))
        }
        None if certain => format!("{}, but the grasps do not agree yet: one more", percent(p)),
        None => format!("one more grasp: {}", leaders(&view.labels, now)),
    }
}

/// Whether the decision is right, once there is one. An object that is no class is rightly called unknown.
pub(super) fn is_right(view: &IdentificationView, truth: &str) -> Option<bool> {
    let decided = view.decided()?;
    let named = view.decision != Some(StopReason::Unknown);
    Some(if named { decided == truth } else { view.labels.class(truth).is_none() })
}

/// What people call a class.
pub(super) fn title(labels: &Labels, class: usize) -> String {
    labels.classes.get(class).map_or_else(String::new, |class| title_of(&class.name))
}

/// A probability as a percentage, rounded down so that what falls short of a threshold never looks as if it reached
/// it; with a decimal where whole steps are too coarse.
pub(super) fn percent(p: f64) -> String {
    let tenths = (p * 1e3 + 1e-6).floor().clamp(0.0, 999.0);
    if tenths > 990.0 { format!("{:.1} %", tenths / 10.0) } else { format!("{:.0} %", (tenths / 10.0).floor()) }
}

/// The same without decimals, where there is little room.
pub(super) fn whole_percent(p: f64) -> String {
    percent(p.min(0.99))
}

/// The two most likely classes: `lemon 61 %, tomato 30 %`.
fn leaders(labels: &Labels, pmf: &Pmf) -> String {
    let two = ranked(pmf).into_iter().take(2);
    let texts: Vec<String> = two
        .map(|class| format!("{} {}", title(labels, class).to_lowercase(), percent(pmf.probabilities()[class])))
        .collect();
    texts.join(", ")
}

/// Classes from the most likely to the least.
pub(super) fn ranked(pmf: &Pmf) -> Vec<usize> {
    let mut order: Vec<usize> = (0..pmf.classes()).collect();
    order.sort_by(|a, b| pmf.probabilities()[*b].total_cmp(&pmf.probabilities()[*a]));
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_lab::datasets::labels_of_catalogue;
    use palpate_learn::{StopRule, Verdict};
    use std::sync::Arc;

    fn pmf(lemon: f64) -> Pmf {
        let labels = labels_of_catalogue();
        let [lemon_at, tomato_at] = ["lemon", "tomato"].map(|name| labels.class(name).unwrap());
        Pmf::from_weights((0..labels.classes.len()).map(|k| match k {
            k if k == lemon_at => lemon,
            k if k == tomato_at => 0.9 * (1.0 - lemon),
            _ => 0.1 * (1.0 - lemon) / 15.0,
        }))
    }

    fn view(now: Option<f64>, beliefs: &[f64], decision: Option<StopReason>) -> IdentificationView {
        IdentificationView {
            labels: Arc::new(labels_of_catalogue()),
            has_stage_one: true,
            rule: StopRule { threshold: 0.9, most_grasps: 4 },
            verdict: now.map(|p| Verdict { pmf: pmf(p), properties: None }),
            listening: false,
            beliefs: beliefs.iter().map(|p| pmf(*p)).collect(),
            decision,
        }
    }

    fn said(view: &IdentificationView) -> (String, String) {
        let text = Headline::of(view).text(&view.labels).0;
        let waiting = "the fingers close";
        (text, reason(view, &Recognised { view: None, off: None, truth: None, waiting, finished: false }))
    }

    #[test]
    fn every_state_has_its_words() {
        let listening =
            |now: f64, beliefs: &[f64]| IdentificationView { listening: true, ..view(Some(now), beliefs, None) };
        let cases = [
            (view(None, &[], None), "Ready", "the fingers close"),
            (listening(0.35, &[]), "Tomato", "grasp 1 of at most 4; it is sure from 90 % on"),
            (listening(0.61, &[]), "Lemon", "grasp 1 of at most 4; it is sure from 90 % on"),
            (listening(0.7, &[0.61]), "Lemon", "grasp 2 of at most 4; before it: lemon 61 %, tomato 35 %"),
            (view(Some(0.61), &[0.61], None), "Lemon", "one more grasp: lemon 61 %, tomato 35 %"),
            (view(Some(0.92), &[0.92], None), "Lemon", "92 %, but less sure than it is of what it knows: one more"),
            (view(Some(0.92), &[0.5, 0.92], None), "Lemon", "92 %, but the grasps do not agree yet: one more"),
            (view(Some(0.92), &[0.92], Some(StopReason::Sure)), "Lemon", "92 % reaches the threshold of 90 %"),
            (view(Some(0.8), &[0.8], Some(StopReason::Sure)), "Lemon", "80 % reached the threshold that was set then"),
            (view(Some(0.6), &[0.6; 4], Some(StopReason::GraspLimit)), "Lemon", "grasp limit of 4 reached, best guess"),
            (
                view(Some(0.6), &[0.6], Some(StopReason::Unknown)),
                "Unknown",
                "the grasps agree on none of the known objects",
            ),
        ];
        for (view, headline, reason) in cases {
            assert_eq!(said(&view), (headline.to_owned(), reason.to_owned()));
        }
        let torn = IdentificationView {
            verdict: Some(Verdict { pmf: Pmf::uniform(17), properties: None }),
            ..listening(0.5, &[])
        };
        assert_eq!(Headline::of(&torn), Headline::Feeling);
    }

    #[test]
    fn it_is_right_about_what_it_knows_and_about_what_nobody_told_it() {
        let decided = |reason| view(Some(0.95), &[0.95], Some(reason));
        assert_eq!(is_right(&view(Some(0.95), &[], None), "lemon"), None);
        assert_eq!(is_right(&decided(StopReason::Sure), "lemon"), Some(true));
        assert_eq!(is_right(&decided(StopReason::GraspLimit), "tomato"), Some(false));
        assert_eq!(is_right(&decided(StopReason::Unknown), "tomato"), Some(false));
        assert_eq!(is_right(&decided(StopReason::Unknown), "part of my own"), Some(true));
    }

    #[test]
    fn percentages_never_flatter() {
        let texts = [0.0, 0.0049, 0.57, 0.8999, 0.9, 0.99, 0.9951, 0.99999, 1.0].map(percent);
        assert_eq!(texts, ["0 %", "0 %", "57 %", "89 %", "90 %", "99 %", "99.5 %", "99.9 %", "99.9 %"]);
    }
}
