//! Sentences of presenter mode, for people who have never heard of the project.

use crate::app::panels::recognition::words::{Headline, leads, left, newest, percent, ranked, title};
use crate::app::widgets::capital;
use palpate_geometry::units::mm;
use palpate_lab::grasping::IdentificationView;
use palpate_lab::workers::Snapshot;
use palpate_learn::{Measure, OTHER, StopReason};
use palpate_sim::gripper::{Mount, Phase};
use palpate_sim::objects::EMPTY;

/// What the picture shows.
pub(super) const ENCODING: &str = "Colour: pressure on each spot. Arrows: force of each finger. 1 N: weight of 100 g.";

/// What happens now.
pub(super) fn story(snapshot: &Snapshot) -> &'static str {
    let touches = !snapshot.frame.taxels.is_empty();
    let again = snapshot.status.grasp_of_round > 1;
    match (snapshot.status.finished, snapshot.frame.phase) {
        (true, _) => "This is where the fingers felt it.",
        (false, Phase::Close) if !touches && again => "Another grasp, from another side.",
        (false, Phase::Close) if !touches => "It cannot see. Its soft fingers close on something.",
        (false, Phase::Close) => "Touch! The fingers bend, the pads feel it press.",
        (false, Phase::Hold) if snapshot.status.nothing_held => "The object has left the hand.",
        (false, Phase::Hold) => "It holds: bend tells size, pressure tells shape.",
        (false, _) => "It lets go.",
    }
}

/// Why this answer, and what follows from it. Where the object has left the hand, its width is not felt.
pub(super) fn reason(view: &IdentificationView, is_lost: bool) -> String {
    let threshold = percent(view.rule.threshold);
    let grasps = match view.beliefs.len() {
        1 => "one grasp".to_owned(),
        many => format!("{many} grasps"),
    };
    let p = newest(view).map(|pmf| pmf.top().1);
    let follows = match (view.decision, p) {
        (Some(_), _) if view.asks_for_more => format!("Now {threshold} is asked for. Press M: one more grasp."),
        (Some(StopReason::Sure), Some(p)) if p >= view.rule.threshold => {
            format!("{} is enough after {grasps}: it decides.", percent(p))
        }
        (Some(StopReason::Sure), _) => format!("That was enough after {grasps}: it decided."),
        (Some(StopReason::GraspLimit), _) => format!("Still not sure after {grasps}: this is its best guess."),
        (Some(StopReason::Unknown), _) => "Its grasps fit nothing that it knows.".to_owned(),
        (None, Some(p)) if !view.listening && p >= view.rule.threshold => {
            "Likely, but its grasps do not fit together: it grasps again.".to_owned()
        }
        (None, Some(p)) if !view.listening => {
            format!("{} is less than {threshold}: it grasps again and adds up what it feels.", percent(p))
        }
        (None, _) if !view.beliefs.is_empty() => {
            format!("It adds this grasp to the {grasps} before, until one name has {threshold} when a grasp ends.")
        }
        (None, _) => "It compares this touch with the grasps that it has learned from.".to_owned(),
    };
    let others = left(view).map_or_else(|| rival(view), |left| format!("{}.", capital(&left)));
    let felt = if is_lost { String::new() } else { felt(view) };
    [felt, others, follows].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
}

/// The width that it has measured; none of an empty hand, nor of what is like nothing that it knows.
fn felt(view: &IdentificationView) -> String {
    if leads(view, EMPTY) || leads(view, OTHER) {
        return String::new();
    }
    let width = view.measured.as_ref().and_then(|measured| measured.of(Measure::Width));
    width.map_or_else(String::new, |width| match width.felt().map(|end| end.map(mm)) {
        [Some(from), Some(to)] => format!("It feels {from:.0} to {to:.0} mm wide."),
        _ => format!("It feels {} wide.", width.words("")),
    })
}

/// What else it may be beside the class that is named, where that is worth a word.
fn rival(view: &IdentificationView) -> String {
    /// Least probability worth a word.
    const WORTH_NAMING: f64 = 0.05;
    let named = view.decision.is_none() && Headline::of(view).class().is_some();
    let Some(pmf) = newest(view).filter(|_| named) else { return String::new() };
    let Some(second) = ranked(pmf).get(1).copied() else { return String::new() };
    let p = pmf.probabilities()[second];
    if p < WORTH_NAMING {
        return String::new();
    }
    let name = match view.labels.other() == Some(second) {
        true => "something unknown".to_owned(),
        false => title(&view.labels, second),
    };
    format!("It may also be {name} ({}).", percent(p))
}

/// That the pose is a hard one, and why.
pub(super) fn hard_pose(mount: &Mount) -> String {
    let [x, y, _] = mount.offset;
    format!("A hard one: the hand is {:.0} mm off centre, turned by {:.0}\u{b0}.", mm(x.hypot(y)), mount.yaw_deg.abs())
}
