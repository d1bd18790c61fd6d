//! Texts of the recognition panel.

use crate::app::shown::Recognised;
use crate::app::widgets::capital;
use palpate_geometry::palette::{Rgb, ThemeColours};
use palpate_lab::grasping::IdentificationView;
pub(in crate::app) use palpate_lab::why::percent;
use palpate_learn::{Labels, OTHER, Pmf, StopReason};
use palpate_sim::objects::capital_title;

/// Least probability at which a running first grasp names its leader.
const WORTH_NAMING: f64 = 0.4;

/// Warning about a model on a gripper whose sensors it does not know.
pub(super) const FOREIGN: &str = "Not to be trusted: this model knows perfect sensors only.";

/// Warning about a model of other fingers.
pub(super) const OTHER_FINGERS: &str = "Not to be trusted: the model has not learned these fingers.";

/// Warning about a grasp that began far from all that the model learned.
pub(super) const UNLIKE: &str = "Not to be trusted: the grasp began unlike any that the model learned.";

/// Warnings about an object that was learned only as it is not held now.
pub(super) const LEARNED_FREE: &str = "Learned as a free object, not yet fixed in place.";
pub(super) const LEARNED_FIXED: &str = "Learned fixed in place, not yet as a free object.";

/// Warning about an object that the model has not learned.
pub(super) const NOT_LEARNED: &str = "The model does not know this object.";

/// Warning about an answer of a model that is learning the object in the hand.
pub(super) const BEING_LEARNED: &str = "Being learned: the model does not know it yet.";

/// Warning about an answer that lacks the grasps before it.
pub(super) const ALONE: &str = "From this grasp alone: the model has changed since those before it.";

/// Headline of the panel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::app) enum Headline {
    /// No answer yet.
    Waiting,
    /// Too early to say.
    Sensing,
    /// Leading class by index, and its probability.
    Leading(usize, f64),
    /// Decided class by index, and its probability.
    Decided(usize, f64),
    /// Likeliest class at the limit of grasps by index, and its probability.
    Guess(usize, f64),
    /// None of the known classes.
    Unknown,
}

impl Headline {
    pub(in crate::app) fn of(view: &IdentificationView) -> Self {
        if view.listening && view.beliefs.is_empty() && !has_touched(view) {
            return if view.verdict.is_some() { Self::Sensing } else { Self::Waiting };
        }
        let Some((class, p)) = newest(view).map(Pmf::top) else { return Self::Waiting };
        match view.decision {
            Some(StopReason::Unknown) => Self::Unknown,
            Some(StopReason::Sure) => Self::Decided(class, p),
            Some(StopReason::GraspLimit) => Self::Guess(class, p),
            // A first touch is like no known object yet.
            None if view.listening && view.beliefs.is_empty() && (p < WORTH_NAMING || is_other(view, class)) => {
                Self::Sensing
            }
            None => Self::Leading(class, p),
        }
    }

    /// Text and probability.
    pub(in crate::app) fn text(self, labels: &Labels) -> (String, Option<f64>) {
        match self {
            Self::Waiting => ("No contact yet".to_owned(), None),
            Self::Sensing => ("Sensing …".to_owned(), None),
            Self::Unknown => ("Unknown".to_owned(), None),
            Self::Guess(class, p) => (format!("Best guess: {}", title(labels, class)), Some(p)),
            Self::Leading(class, p) | Self::Decided(class, p) => (title(labels, class), Some(p)),
        }
    }

    /// The class that it names, by index.
    pub(in crate::app) fn class(self) -> Option<usize> {
        match self {
            Self::Leading(class, _) | Self::Decided(class, _) | Self::Guess(class, _) => Some(class),
            Self::Waiting | Self::Sensing | Self::Unknown => None,
        }
    }

    /// Its colour: green for a decision, amber for a guess, red for a wrong answer.
    pub(in crate::app) fn ink(self, colours: &ThemeColours, right: Option<bool>) -> Rgb {
        match self {
            Self::Decided(..) | Self::Guess(..) | Self::Unknown if right == Some(false) => colours.error,
            Self::Decided(..) => colours.good,
            Self::Guess(..) | Self::Unknown => colours.warning,
            Self::Leading(..) => colours.text,
            Self::Waiting | Self::Sensing => colours.quiet_text,
        }
    }
}

/// True where this class is the likeliest.
pub(in crate::app) fn leads(view: &IdentificationView, class: &str) -> bool {
    newest(view).is_some_and(|pmf| view.labels.class(class) == Some(pmf.top().0))
}

fn is_other(view: &IdentificationView, class: usize) -> bool {
    view.labels.other() == Some(class)
}

/// True once the running grasp has touched something, and where that cannot be told.
pub(super) fn has_touched(view: &IdentificationView) -> bool {
    !view.measures_geometry || view.measured.is_some()
}

/// Newest answer: of the running grasp or, before its first contact, of the grasps before.
pub(in crate::app) fn newest(view: &IdentificationView) -> Option<&Pmf> {
    let running = view.verdict.as_ref().filter(|_| !view.listening || has_touched(view));
    running.map(|verdict| &verdict.pmf).or(view.beliefs.last())
}

/// Answer of the running grasp, once it is one: before, the headline says that it senses.
pub(in crate::app) fn running(view: &IdentificationView) -> Option<&Pmf> {
    let touched = view.verdict.as_ref().filter(|_| has_touched(view) && Headline::of(view) != Headline::Sensing);
    touched.map(|verdict| &verdict.pmf)
}

/// Most classes that are named as left.
const NAMED: usize = 3;

/// Reason for another grasp, or for the decision, and the classes that are left.
pub(in crate::app) fn reason(view: &IdentificationView, recognised: &Recognised<'_>) -> String {
    let why = why(view, recognised);
    left(view).map_or_else(|| why.clone(), |left| format!("{why}. {}", capital(&left)))
}

/// Classes that are left after finished grasps, where the model's sets are calibrated.
pub(in crate::app) fn left(view: &IdentificationView) -> Option<String> {
    let left = view.left.as_ref().filter(|_| !view.beliefs.is_empty())?;
    let classes = (0..left.len()).filter(|class| left[*class]);
    let names: Vec<String> = classes.map(|class| title(&view.labels, class).to_lowercase()).collect();
    Some(match names.as_slice() {
        [] => "like no known object".to_owned(),
        [only] => format!("only {only} left"),
        [first @ .., last] if names.len() <= NAMED => format!("{} or {last}", first.join(", ")),
        _ => format!("{} objects left", names.len()),
    })
}

fn why(view: &IdentificationView, recognised: &Recognised<'_>) -> String {
    let (threshold, most) = (percent(view.rule.threshold), view.rule.most_grasps);
    let Some(now) = newest(view) else {
        let failed = "Grasp failed: no answer";
        // Early in a stored grasp nothing has failed yet.
        return if recognised.finished && !view.listening { failed } else { recognised.waiting }.to_owned();
    };
    let p = now.top().1;
    let certain = p >= view.rule.threshold;
    let again = recognised.again;
    let grasp = format!("Grasp {} of up to {most}", view.beliefs.len() + 1);
    match view.decision {
        Some(StopReason::Sure) if is_other(view, now.top().0) => "None of the known objects".to_owned(),
        Some(StopReason::Sure) if certain => format!("Certain: {} (needed {threshold})", percent(p)),
        Some(StopReason::Sure) => format!("Certain: {} reached the threshold of then", percent(p)),
        Some(StopReason::GraspLimit) => match view.beliefs.len() {
            1 => "Best guess after one grasp".to_owned(),
            many => format!("Best guess after {many} grasps"),
        },
        Some(StopReason::Unknown) => "The grasps agree on no known object".to_owned(),
        None if view.listening => match view.beliefs.last() {
            Some(before) => format!("{grasp}. Before it: {}", leaders(&view.labels, before)),
            None if view.rule.threshold >= 1.0 => format!("{grasp}, without automatic stop"),
            None => format!("{grasp}, needed {threshold}"),
        },
        None if recognised.finished => format!("Not certain (needed {threshold}): {}", leaders(&view.labels, now)),
        None if certain && view.beliefs.len() == 1 => {
            format!("{}, but unlike any known object: {again}", percent(p))
        }
        None if certain => format!("{}, but the grasps disagree: {again}", percent(p)),
        // Fingers feel each other, too.
        None if recognised.nothing_held => format!("Object not held ({}): {again}", leaders(&view.labels, now)),
        None => format!("Not sure yet ({}): {again}", leaders(&view.labels, now)),
    }
}

/// Title of a class.
pub(in crate::app) fn title(labels: &Labels, class: usize) -> String {
    labels.classes.get(class).map_or_else(String::new, |class| match class.name.as_str() {
        OTHER => "Other".to_owned(),
        name => capital_title(name),
    })
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
pub(in crate::app) fn ranked(pmf: &Pmf) -> Vec<usize> {
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
            rule: StopRule { threshold: 0.9, most_grasps: 4 },
            verdict: now.map(|p| Verdict { pmf: pmf(p), properties: None }),
            measures_geometry: false,
            unlike: false,
            measured: None,
            listening: false,
            beliefs: beliefs.iter().map(|p| pmf(*p)).collect(),
            decision,
            left: None,
            asks_for_more: false,
            from_perfect_sensors: false,
            signatures: None,
            last: None,
        }
    }

    fn said(view: &IdentificationView) -> (String, String) {
        let text = Headline::of(view).text(&view.labels).0;
        let (waiting, again) = ("Fingers closing", "grasping again");
        (
            text,
            reason(
                view,
                &Recognised {
                    view: None,
                    off: None,
                    truth: None,
                    nothing_held: false,
                    waiting,
                    again,
                    finished: false,
                },
            ),
        )
    }

    #[test]
    fn every_state_has_its_words() {
        let listening =
            |now: f64, beliefs: &[f64]| IdentificationView { listening: true, ..view(Some(now), beliefs, None) };
        let cases = [
            (view(None, &[], None), "No contact yet", "Fingers closing"),
            (listening(0.35, &[]), "Tomato", "Grasp 1 of up to 4, needed 90 %"),
            (listening(0.61, &[]), "Lemon", "Grasp 1 of up to 4, needed 90 %"),
            (listening(0.7, &[0.61]), "Lemon", "Grasp 2 of up to 4. Before it: lemon 61 %, tomato 35 %"),
            (view(Some(0.61), &[0.61], None), "Lemon", "Not sure yet (lemon 61 %, tomato 35 %): grasping again"),
            (view(Some(0.92), &[0.92], None), "Lemon", "92 %, but unlike any known object: grasping again"),
            (view(Some(0.92), &[0.5, 0.92], None), "Lemon", "92 %, but the grasps disagree: grasping again"),
            (view(Some(0.92), &[0.92], Some(StopReason::Sure)), "Lemon", "Certain: 92 % (needed 90 %)"),
            (view(Some(0.8), &[0.8], Some(StopReason::Sure)), "Lemon", "Certain: 80 % reached the threshold of then"),
            (
                view(Some(0.6), &[0.6; 4], Some(StopReason::GraspLimit)),
                "Best guess: Lemon",
                "Best guess after 4 grasps",
            ),
            (view(Some(0.6), &[0.6], Some(StopReason::Unknown)), "Unknown", "The grasps agree on no known object"),
        ];
        for (view, headline, reason) in cases {
            assert_eq!(said(&view), (headline.to_owned(), reason.to_owned()));
        }
        let torn = IdentificationView {
            verdict: Some(Verdict { pmf: Pmf::uniform(17), properties: None }),
            ..listening(0.5, &[])
        };
        assert_eq!(Headline::of(&torn), Headline::Sensing);
        // Before the contact the belief so far stands; readings of free fingers say nothing.
        let free = IdentificationView { measures_geometry: true, ..listening(0.2, &[0.86]) };
        assert_eq!(said(&free).0, "Lemon");
        assert_eq!(Headline::of(&IdentificationView { beliefs: Vec::new(), ..free }), Headline::Sensing);
    }

    #[test]
    fn classes_that_are_left_are_named_or_counted() {
        let labels = labels_of_catalogue();
        let of = |names: &[&str]| {
            let left = labels.classes.iter().map(|class| names.contains(&class.name.as_str())).collect();
            said(&IdentificationView { left: Some(left), ..view(Some(0.61), &[0.61], None) }).1
        };
        let why = "Not sure yet (lemon 61 %, tomato 35 %): grasping again";
        assert_eq!(of(&["lemon", "tomato"]), format!("{why}. Lemon or tomato"));
        assert_eq!(of(&["lemon"]), format!("{why}. Only lemon left"));
        assert_eq!(of(&[]), format!("{why}. Like no known object"));
        assert_eq!(of(&["lemon", "tomato", "ball", "cube"]), format!("{why}. 4 objects left"));
        let first = IdentificationView { left: Some(vec![true; 17]), ..view(Some(0.3), &[], None) };
        assert!(!said(&first).1.contains("left"), "before the first grasp ends");
        let rule = StopRule { threshold: 1.0, most_grasps: 4 };
        let never = IdentificationView { rule, listening: true, ..view(Some(0.5), &[], None) };
        assert_eq!(said(&never).1, "Grasp 1 of up to 4, without automatic stop");
    }

    #[test]
    fn unknown_is_right_for_an_object_that_is_no_class() {
        let decided = |reason| view(Some(0.95), &[0.95], Some(reason));
        assert_eq!(view(Some(0.95), &[], None).is_right("lemon", false), None);
        assert_eq!(decided(StopReason::Sure).is_right("lemon", false), Some(true));
        assert_eq!(decided(StopReason::GraspLimit).is_right("tomato", false), Some(false));
        assert_eq!(decided(StopReason::Unknown).is_right("tomato", false), Some(false));
        assert_eq!(decided(StopReason::Unknown).is_right("part of my own", false), Some(true));
    }

    #[test]
    fn an_empty_hand_is_right_for_an_object_that_has_left_it() {
        let labels = labels_of_catalogue();
        let empty = labels.class("empty").expect("is a class");
        let belief = Pmf::from_weights((0..labels.classes.len()).map(|k| if k == empty { 0.95 } else { 0.003 }));
        let told = IdentificationView { beliefs: vec![belief], ..view(None, &[], Some(StopReason::Sure)) };
        assert_eq!([false, true].map(|gone| told.is_right("tomato", gone)), [Some(false), Some(true)]);
        let lemon = view(Some(0.95), &[0.95], Some(StopReason::Sure));
        assert_eq!(lemon.is_right("tomato", true), Some(false));
        assert_eq!(lemon.is_right("lemon", true), Some(true), "it was felt before it left");
    }

    #[test]
    fn percentages_never_flatter() {
        let texts = [0.0, 0.0049, 0.57, 0.8999, 0.9, 0.99, 0.9951, 0.99999, 1.0].map(percent);
        assert_eq!(texts, ["0 %", "0 %", "57 %", "89 %", "90 %", "99 %", "99.5 %", "99.9 %", "99.9 %"]);
    }
}
