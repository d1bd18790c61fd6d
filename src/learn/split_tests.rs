//! Splits: shares and folds as counted by hand, copies on one side, plans as text.

use crate::data::{Class, Dataset, Example, Labels};
use crate::split::{Split, SplitPlan};

/// Different grasps of two classes, in turn, the poses of each in turn too.
fn data(of_each: usize) -> Dataset {
    let class = |name: &str| Class { name: name.to_owned(), size: None, shape: None };
    let labels = Labels { classes: vec![class("ball"), class("cube"), class("unused")], ..Labels::default() };
    let example = |k: usize| Example {
        id: k as i64 + 100,
        class: k % 2,
        content: k as u64,
        pose: (k / 2 % 4) as u32,
        ..Example::default()
    };
    Dataset { labels, examples: (0..2 * of_each).map(example).collect(), ..Dataset::default() }
}

fn counts(split: &Split) -> [usize; 3] {
    [split.train.len(), split.second.len(), split.test.len()]
}

/// Every plan of the command line.
fn plans() -> Vec<SplitPlan> {
    ["40/40/20", "80/20", "folds:5", "first:6", "first:6:2", "leave-a-pose-out"].map(|t| t.parse().unwrap()).into()
}

#[test]
fn shares_are_those_of_each_class() {
    let data = data(50);
    let splits = SplitPlan::Shares([0.4, 0.4, 0.2]).splits(&data, 7, 3).unwrap();
    for split in &splits {
        assert_eq!(counts(split), [40, 40, 20]);
        for (part, expected) in [(&split.train, 20), (&split.second, 20), (&split.test, 10)] {
            assert_eq!(part.iter().filter(|k| data.examples[**k].class == 0).count(), expected);
        }
    }
    assert_eq!(splits.len(), 3);
    assert_ne!(splits[0].test, splits[1].test, "repeats draw anew");
    assert_eq!(splits, SplitPlan::Shares([0.4, 0.4, 0.2]).splits(&data, 7, 3).unwrap());
    assert_ne!(splits, SplitPlan::Shares([0.4, 0.4, 0.2]).splits(&data, 8, 3).unwrap());
    assert_eq!(counts(&SplitPlan::Shares([0.4, 0.4, 0.2]).splits(&self::data(3), 1, 1).unwrap()[0]), [2, 2, 2]);
}

#[test]
fn folds_test_each_grasp_once() {
    let data = data(22);
    let splits = SplitPlan::Folds { folds: 5 }.splits(&data, 3, 2).unwrap();
    assert_eq!(splits.len(), 10);
    for repeat in splits.chunks(5) {
        let mut tested: Vec<usize> = repeat.iter().flat_map(|split| split.test.clone()).collect();
        tested.sort_unstable();
        assert_eq!(tested, (0..44).collect::<Vec<_>>());
        assert!(repeat.iter().all(|split| split.train.len() + split.test.len() == 44));
        assert!(repeat.iter().all(|split| (8..=9).contains(&split.test.len())));
    }
}

#[test]
fn the_first_of_each_are_the_oldest() {
    let plan = SplitPlan::FirstOfEach { train: 3, test: Some(2) };
    let splits = plan.splits(&data(10), 1, 4).unwrap();
    let expected = Split { train: (0..6).collect(), second: vec![], test: (6..10).collect() };
    assert_eq!(splits, [expected]);
    let too_many = SplitPlan::FirstOfEach { train: 10, test: None }.splits(&data(10), 1, 1);
    let text = too_many.unwrap_err().to_string();
    assert!(text.starts_with("object \"ball\" has 10 different grasp(s) in 10 trial(s), 11 are needed"), "{text}");
}

#[test]
fn a_pose_is_never_on_both_sides() {
    let data = data(10);
    let splits = SplitPlan::LeavePoseOut.splits(&data, 1, 1).unwrap();
    assert_eq!(splits.len(), 4);
    for (pose, split) in splits.iter().enumerate() {
        assert!(split.test.iter().all(|k| data.examples[*k].pose == pose as u32));
        assert!(split.train.iter().all(|k| data.examples[*k].pose != pose as u32));
    }
    let mut same = data;
    same.examples.iter_mut().for_each(|example| example.pose = 1);
    let refused = SplitPlan::LeavePoseOut.splits(&same, 1, 1).unwrap_err();
    assert!(refused.to_string().starts_with("all trials of \"ball\" are of the same pose"), "{refused}");
}

#[test]
fn copies_of_a_grasp_are_never_on_both_sides() {
    let mut copied = data(20);
    // The same forty grasps once more.
    let again = copied.examples.clone().into_iter().map(|e| Example { id: e.id + 1000, ..e });
    copied.examples.extend(again);
    for plan in plans() {
        for split in plan.splits(&copied, 5, 3).unwrap() {
            split.check(&copied).unwrap();
            let mut used: Vec<u64> = split.all_training().iter().map(|k| copied.examples[*k].content).collect();
            used.extend(split.test.iter().map(|k| copied.examples[*k].content));
            let count = used.len();
            used.sort_unstable();
            used.dedup();
            assert_eq!(used.len(), count, "{plan}: a grasp is used twice");
        }
    }
    let leak = Split { train: vec![0], second: vec![], test: vec![40] };
    let text = leak.check(&copied).unwrap_err().to_string();
    assert!(text.starts_with("trials 100 and 1100 are the same grasp"), "{text}");
}

#[test]
fn six_copies_of_one_grasp_are_refused() {
    let mut copies = data(6);
    copies.examples.iter_mut().for_each(|example| example.content = example.class as u64);
    for plan in plans() {
        let refused = plan.splits(&copies, 1, 1).unwrap_err();
        assert!(refused.to_string().contains("1 different grasp(s) in 6 trial(s)"), "{plan}: {refused}");
    }
}

#[test]
fn grasps_that_follow_each_other_stay_on_one_side() {
    let mut followed = data(40);
    for k in 2..80 {
        // Successions of four grasps of the same class.
        followed.examples[k].after = (k / 2 % 4 != 0).then(|| followed.examples[k - 2].id);
    }
    for plan in ["40/40/20", "folds:4"] {
        for split in plan.parse::<SplitPlan>().unwrap().splits(&followed, 3, 2).unwrap() {
            for part in [&split.train, &split.second, &split.test] {
                let whole = |k: &usize| (0..80).filter(|o| o % 2 == k % 2 && o / 8 == k / 8).all(|o| part.contains(&o));
                assert!(part.iter().all(whole), "{plan}");
            }
            assert_eq!(split.train.len() + split.second.len() + split.test.len(), 80);
            assert!((16..=24).contains(&split.test.len()), "{plan}: {:?}", split.test);
        }
    }
}

/// Two classes as successions of the same lengths.
fn successions(lengths: &[usize]) -> Dataset {
    let mut followed = data(lengths.iter().sum());
    let starts: Vec<usize> =
        lengths.iter().scan(0, |end, length| Some(std::mem::replace(end, *end + length))).collect();
    for k in 2..followed.examples.len() {
        followed.examples[k].after = (!starts.contains(&(k / 2))).then(|| followed.examples[k - 2].id);
    }
    followed
}

#[test]
fn every_part_gets_a_succession_however_long_the_others_are() {
    for (lengths, plan) in [(&[1, 9][..], "80/20"), (&[9, 1, 1], "40/40/20")] {
        let (data, plan) = (successions(lengths), plan.parse::<SplitPlan>().unwrap());
        for split in plan.splits(&data, 3, 20).unwrap() {
            let parts = [&split.train, &split.test, &split.second].into_iter().take(lengths.len());
            for part in parts {
                assert!((0..2).all(|class| part.iter().any(|k| data.examples[*k].class == class)), "{plan}: {split:?}");
            }
            assert_eq!(counts(&split).iter().sum::<usize>(), data.examples.len());
        }
    }
}

#[test]
fn an_object_that_was_placed_once_is_refused_by_random_plans() {
    for (lengths, plan, needed) in [(&[10][..], "80/20", 2), (&[10], "folds:5", 2), (&[9, 1], "40/40/20", 3)] {
        let refused = plan.parse::<SplitPlan>().unwrap().splits(&successions(lengths), 1, 1).unwrap_err();
        let successions = lengths.len();
        let expected = format!(
            "object \"ball\" was put down anew only {successions} time(s) for its 10 grasps, but this split needs {needed}: "
        );
        assert!(refused.to_string().starts_with(&expected), "{plan}: {refused}");
    }
    for plan in ["first:6", "leave-a-pose-out"] {
        assert!(plan.parse::<SplitPlan>().unwrap().splits(&successions(&[10]), 1, 1).is_ok(), "{plan}");
    }
}

#[test]
fn extreme_counts_are_no_fault() {
    let splits = "folds:99999999999999".parse::<SplitPlan>().unwrap().splits(&data(5), 1, 1).unwrap();
    assert_eq!(splits.len(), 10);
    assert!(splits.iter().all(|split| counts(split) == [9, 0, 1]));
    let all = SplitPlan::FirstOfEach { train: usize::MAX, test: None }.splits(&data(5), 1, 1);
    assert!(all.unwrap_err().to_string().contains(&format!("{} are needed", usize::MAX)));
}

#[test]
fn learning_curves_are_nested() {
    let data = data(30);
    let split = &SplitPlan::Shares([0.8, 0.0, 0.2]).splits(&data, 2, 1).unwrap()[0];
    let (few, many) = (split.limited(&data, 5), split.limited(&data, 10));
    assert_eq!((counts(&few), counts(&many)), ([10, 0, 12], [20, 0, 12]));
    assert!(few.train.iter().all(|k| many.train.contains(k)) && few.test == split.test);
    assert_eq!(split.limited(&data, 1000), *split);
}

#[test]
fn imbalanced_counts_are_in_their_range() {
    let data = data(60);
    let drawn = data.imbalanced(40..=55, 9);
    let counts: Vec<usize> = drawn.by_class().iter().map(Vec::len).collect();
    assert!(counts[..2].iter().all(|count| (40..=55).contains(count)) && counts[0] != counts[1], "{counts:?}");
    assert_eq!(drawn, data.imbalanced(40..=55, 9));
    assert_eq!(drawn.about.grasps, drawn.examples.len());
}

#[test]
fn plans_are_written_as_they_are_read() {
    for (text, shown) in [
        ("40/40/20", "random shares 40/40/20"),
        ("80/0/20", "random shares 80/0/20"),
        ("folds:5", "cross-validation with 5 folds"),
        ("first:50", "first 50 of each object for training"),
        ("first:50:100", "first 50 of each object for training, the next 100 for testing"),
        ("leave-a-pose-out", "one pose left out at a time"),
    ] {
        let plan: SplitPlan = text.parse().unwrap();
        assert_eq!((plan.to_string(), plan.described()), (text.to_owned(), shown.to_owned()));
        let json = serde_json::to_string(&plan).unwrap();
        assert_eq!(serde_json::from_str::<SplitPlan>(&json).unwrap(), plan);
    }
    for nonsense in ["", "50", "folds", "folds:1", "first:", "40/40/40", "0/50/50", "-20/100/20", "a/b"] {
        assert!(nonsense.parse::<SplitPlan>().is_err(), "{nonsense}");
    }
}
