//! What every recogniser must do, tried on made-up grasps: learn, repeat itself, survive storing, refuse nonsense.

use super::evaluation::{MOST_GRASPS, answer, evaluate, product_of_experts, rounds};
use super::metrics::{Bootstrap, Confusion};
use super::{
    Class, DataCard, Dataset, Example, FitError, Fitting, Labels, METHODS, Method, Model, ModelError, Sequence,
    StopRule,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

static NEVER: AtomicBool = AtomicBool::new(false);

fn quick(seed: u64) -> Fitting<'static> {
    Fitting { seed, quick: true, settings: serde_json::Map::new(), progress: &|_| (), stop: &NEVER }
}

/// Made-up grasps of four objects: large ones are met early, hard ones press more, and every grasp is off by something.
pub(super) fn made_up(of_each: usize, seed: u64) -> Dataset {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let class = |name: &str, size, shape| Class { name: name.to_owned(), size: Some(size), shape: Some(shape) };
    let classes = vec![class("ball", 1, 1), class("brick", 1, 0), class("cube", 0, 0), class("marble", 0, 1)];
    let words = |list: &[&str]| list.iter().map(|w| (*w).to_owned()).collect();
    let labels = Labels { classes, sizes: words(&["tiny", "large"]), shapes: words(&["cubic", "spherical"]) };
    let mut examples = Vec::new();
    for number in 0..of_each {
        for (index, class) in labels.classes.iter().enumerate() {
            let onset = if class.size == Some(1) { 0.6 } else { 1.1 } + 0.2 * random.random::<f32>();
            let press = if class.shape == Some(0) { 2.0 } else { 1.2 } + 0.4 * random.random::<f32>();
            let t_s: Vec<f32> = (1..=40).map(|k| k as f32 * 0.05).collect();
            let mut values = Vec::new();
            for t in &t_s {
                let after = (t - onset).max(0.0);
                for side in [1.0, 0.9] {
                    values.push(side * (t.min(onset) * 8.0 + after * press) + 0.05 * random.random::<f32>());
                }
                for side in [1.0, 0.9] {
                    values.push(side * press * after + 0.02 * random.random::<f32>());
                }
            }
            let id = (number * labels.classes.len() + index) as i64;
            examples.push(Example { id, class: index, grasp: Arc::new(Sequence { t_s, values }) });
        }
    }
    let channels = words(&["curvature_left", "curvature_right", "force_left", "force_right"]);
    Dataset { channels, labels, about: DataCard { grasps: examples.len(), ..DataCard::default() }, examples }
}

fn accuracy(model: &Model, data: &Dataset) -> f64 {
    let answers = answer(model.recogniser.as_ref(), data);
    let pairs = answers.truth.iter().zip(&answers.verdicts).map(|(t, v)| (*t, Some(v.pmf.top().0)));
    Confusion::from_pairs(data.labels.classes.len(), pairs).and_then(|c| c.macro_accuracy()).expect("has trials")
}

fn trained(method: &Method, data: &Dataset) -> Model {
    method.train(data, &quick(1)).unwrap_or_else(|error| panic!("{}: {error}", method.key))
}

#[test]
fn every_method_learns_repeats_itself_and_survives_storing() {
    let (train, test) = (made_up(12, 1), made_up(6, 2));
    for method in &METHODS {
        let model = trained(method, &train);
        let reached = accuracy(&model, &test);
        assert!(reached > 0.7, "{} reaches only {reached}", method.key);
        let again = trained(method, &train);
        let loaded = Model::from_bytes("model", &model.to_bytes().expect("writes")).expect(method.key);
        assert_eq!(loaded.card, model.card, "{}", method.key);
        for example in &test.examples {
            let verdict = model.recogniser.recognise(&example.grasp, None);
            assert!((verdict.pmf.probabilities().iter().sum::<f64>() - 1.0).abs() < 1e-9);
            assert_eq!(again.recogniser.recognise(&example.grasp, None), verdict, "{} repeats itself", method.key);
            assert_eq!(loaded.recogniser.recognise(&example.grasp, None), verdict, "{} is stored whole", method.key);
        }
        // Grasps that are empty, short or wild are answered with something that is a PMF.
        let first = &test.examples[0].grasp;
        let wild = Sequence { t_s: first.t_s.clone(), values: first.values.iter().map(|x| x * 1e30).collect() };
        for grasp in [Sequence::default(), first.until(0.1), wild] {
            let pmf = model.recogniser.recognise(&grasp, None).pmf;
            assert!(pmf.probabilities().iter().all(|p| (0.0..=1.0).contains(p)), "{}", method.key);
        }
    }
}

#[test]
fn shuffled_labels_teach_nothing() {
    let (train, test) = (made_up(20, 3), made_up(25, 4));
    for key in ["ds-lstm-cross", "random-forest"] {
        let method = super::method(key).expect("in the list");
        let reached = accuracy(&trained(method, &train.with_shuffled_labels(5)), &test);
        // Chance is a quarter; a hundred test grasps of one class are alike, so that luck is coarse.
        assert!(reached < 0.6, "{key} reaches {reached} from nothing");
    }
}

#[test]
fn no_grasp_is_on_both_sides_of_a_split() {
    let data = made_up(10, 6);
    let (first, rest) = data.first_of_each(7);
    let ids = |data: &Dataset| data.examples.iter().map(|e| e.id).collect::<std::collections::BTreeSet<i64>>();
    assert!(ids(&first).is_disjoint(&ids(&rest)));
    assert_eq!((first.examples.len(), rest.examples.len()), (28, 12));
    let shares = data.shares(&[0.4, 0.4, 0.2], 1);
    assert_eq!(shares.iter().map(|s| s.examples.len()).collect::<Vec<_>>(), [16, 16, 8]);
    let all: std::collections::BTreeSet<i64> = shares.iter().flat_map(ids).collect();
    assert_eq!(all.len(), 40, "every grasp once");
    let folds = data.folds(4, 2);
    for class in data.by_class() {
        let mut counts = [0; 4];
        class.iter().for_each(|k| counts[folds[*k]] += 1);
        assert!(counts.iter().all(|c| (2..=3).contains(c)), "{counts:?}");
    }
}

#[test]
fn answers_grow_surer_with_grasps_and_are_judged() {
    let (train, test) = (made_up(12, 7), made_up(8, 8));
    let model = trained(super::method("ids-lstm").expect("in the list"), &train);
    let recogniser = model.recogniser.as_ref();
    let answers = answer(recogniser, &test);
    let followed = rounds(recogniser, &test, &answers, 1);
    assert!(followed.iter().all(|round| round.belief.grasps() == MOST_GRASPS));
    let independent = product_of_experts(&test, &answers, 1);
    assert!(
        followed
            .iter()
            .zip(&independent)
            .all(|(a, b)| a.truth == b.truth && a.belief.steps()[0] == b.belief.steps()[0])
    );
    let bootstrap = Bootstrap { resamples: 200, seed: 1 };
    let evaluation =
        evaluate(recogniser, &test, &answers, &followed, StopRule::default(), &bootstrap).expect("has trials");
    assert_eq!(evaluation.f1_by_grasps.len(), MOST_GRASPS);
    assert!(evaluation.f1_by_grasps[MOST_GRASPS - 1] + 0.05 >= evaluation.f1_macro, "{evaluation:?}");
    assert!(evaluation.ci95[0] <= evaluation.f1_macro && evaluation.f1_macro <= evaluation.ci95[1]);
    assert!(evaluation.stage_one.is_some_and(|s| s.size_f1 > 0.8 && s.shape_f1 > 0.7));
}

#[test]
fn live_answers_end_as_answers_to_whole_grasps() {
    let train = made_up(10, 9);
    let model = trained(super::method("ids-lstm-cross").expect("in the list"), &train);
    let mut live = model.recogniser.live().expect("networks read live");
    let before = super::Pmf::from_weights([0.1, 0.2, 0.3, 0.4]);
    for (example, before) in train.examples.iter().take(5).zip([None, Some(&before), None, Some(&before), None]) {
        live.begin(before);
        let pushed = example.grasp.rows().filter(|(t, row)| live.push(*t, row).is_some()).count();
        assert!(pushed >= 10, "answers come while the grasp goes on: {pushed}");
        assert_eq!(live.finish(), Some(model.recogniser.recognise(&example.grasp, before)));
    }
}

#[test]
fn data_that_cannot_teach_are_refused_in_words() {
    let data = made_up(6, 10);
    for method in &METHODS {
        let refused = |data: &Dataset| method.train(data, &quick(1)).err().map(|e| e.to_string());
        let only_balls: Vec<usize> = data.by_class()[0].clone();
        let one_class = refused(&data.part(&only_balls)).expect("refused");
        assert!(one_class.contains("only one class, \"ball\""), "{}: {one_class}", method.key);
        assert!(refused(&data.part(&[])).is_some(), "{}", method.key);
        // Two trials of different objects: enough for neighbours, for nothing else.
        let two = refused(&data.part(&[0, 1]));
        assert!(two.is_some_and(|text| text.contains("only 1 grasps")) || method.key == "dtw-knn", "{}", method.key);
        let stopped = AtomicBool::new(true);
        let fitting = Fitting { stop: &stopped, ..quick(1) };
        if method.recipe.is_some() {
            assert_eq!(method.train(&data, &fitting).err(), Some(FitError::Stopped));
            let settings = serde_json::json!({ "unitz": 3 }).as_object().cloned().expect("an object");
            let fitting = Fitting { settings, ..quick(1) };
            assert!(matches!(method.train(&data, &fitting), Err(FitError::Setting { name, .. }) if name == "unitz"));
        }
    }
    let mut bare = data;
    bare.labels.classes.iter_mut().for_each(|class| (class.size, class.shape) = (None, None));
    let error = super::method("ds-lstm").expect("in the list").train(&bare, &quick(1)).err();
    assert!(matches!(error, Some(FitError::NoProperties { .. })));
    assert!(super::method("macro-layer").expect("in the list").train(&bare, &quick(1)).is_ok());
}

#[test]
fn models_cut_short_or_altered_are_refused() {
    let data = made_up(6, 11);
    for method in &METHODS {
        let model = trained(method, &data);
        let bytes = model.to_bytes().expect("writes");
        for part in 0..24 {
            let cut = bytes.len() * part / 24;
            assert!(Model::from_bytes("cut", &bytes[..cut]).is_err(), "{} cut at {cut}", method.key);
        }
        // A card that speaks of other channels, or of a method nobody knows.
        let with = |change: &dyn Fn(&mut super::ModelCard)| {
            let mut altered = model.clone();
            change(&mut altered.card);
            Model::from_bytes("altered", &altered.to_bytes().expect("writes"))
        };
        assert!(with(&|card| card.channels.push("grip".to_owned())).is_err(), "{}", method.key);
        assert!(with(&|card| card.settings = serde_json::Value::Null).is_err(), "{}", method.key);
        let unknown = with(&|card| card.method = "oracle".to_owned());
        assert!(matches!(unknown, Err(ModelError::UnknownMethod { method, .. }) if method == "oracle"));
        let other = ["curvature_left", "curvature_right", "force_left", "grip"].map(str::to_owned);
        let text = model.check_channels(&other).expect_err("other channels").to_string();
        assert!(text.contains("needs force_right") && text.contains("does not know grip"), "{text}");
    }
}

#[test]
fn the_shipped_model_answers_live_and_rejects_the_unknown() {
    let model = super::shipped_model().expect("whole");
    assert!(model.recogniser.live().is_some() && model.card.rejection.is_some());
    assert!(!model.card.quick, "a quick model is not for shipping");
}
