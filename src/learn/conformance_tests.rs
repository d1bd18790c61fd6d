//! Tests that every recogniser must pass, on synthetic grasps: accuracy, repeatability, storage, invalid input.

use crate::evaluation::{MOST_GRASPS, answer, evaluate, product_of_experts, rounds};
use crate::metrics::{Bootstrap, Confusion};
use crate::{
    Class, DataCard, Dataset, Example, Fitting, Labels, LearnError, METHODS, Method, Model, ModelCard, ModelError,
    Numbers, Pmf, Sequence, Shipped, Signatures, StopRule, method,
};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

static NEVER: AtomicBool = AtomicBool::new(false);

pub(crate) fn quick(seed: u64) -> Fitting<'static> {
    Fitting::new(seed, true, &NEVER)
}

/// Synthetic grasps of four objects: contact is earlier with large ones, force rises faster with cubic ones, with noise.
pub(crate) fn made_up(of_each: usize, seed: u64) -> Dataset {
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
            examples.push(Example {
                id,
                class: index,
                grasp: Arc::new(Sequence { t_s, values }),
                content: id.cast_unsigned(),
                ..Example::default()
            });
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
fn every_method_learns_repeatably_and_reloads_exactly() {
    let (few, many, test) = (made_up(12, 1), made_up(40, 1), made_up(6, 2));
    for method in &METHODS {
        // Networks that are read out at the end alone learn more slowly.
        let train = if method.is_strict() { &many } else { &few };
        let model = trained(method, train);
        let reached = accuracy(&model, &test);
        assert!(reached > 0.7, "{} reaches only {reached}", method.key);
        let again = trained(method, train);
        let loaded = Model::from_bytes("model", &model.to_bytes().expect("writes")).expect(method.key);
        assert_eq!(loaded.card, model.card, "{}", method.key);
        assert!(loaded.signatures.is_some() && loaded.signatures == model.signatures, "{}", method.key);
        for example in &test.examples {
            let verdict = model.recogniser.recognise(&example.grasp, None);
            assert!((verdict.pmf.probabilities().iter().sum::<f64>() - 1.0).abs() < 1e-9);
            assert_eq!(again.recogniser.recognise(&example.grasp, None), verdict, "{} is repeatable", method.key);
            assert_eq!(loaded.recogniser.recognise(&example.grasp, None), verdict, "{} reloads exactly", method.key);
        }
        // Empty, short and extreme grasps give a valid PMF.
        let first = &test.examples[0].grasp;
        let extreme = Sequence { t_s: first.t_s.clone(), values: first.values.iter().map(|x| x * 1e30).collect() };
        for grasp in [Sequence::default(), first.until(0.1), extreme] {
            let pmf = model.recogniser.recognise(&grasp, None).pmf;
            assert!(pmf.probabilities().iter().all(|p| (0.0..=1.0).contains(p)), "{}", method.key);
        }
    }
}

#[test]
fn shuffled_labels_give_chance_level() {
    let (train, test) = (made_up(20, 3), made_up(25, 4));
    for key in ["ds-lstm-cross", "random-forest"] {
        let method = method(key).expect("in the list");
        let reached = accuracy(&trained(method, &train.with_shuffled_labels(5)), &test);
        // Chance level is 0.25; test grasps of one class resemble each other, so it varies widely.
        assert!(reached < 0.6, "{key} reaches {reached} on shuffled labels");
    }
}

#[test]
fn folds_are_stratified() {
    let data = made_up(10, 6);
    let folds = data.folds(4, 2);
    for class in data.by_class() {
        let mut counts = [0; 4];
        class.iter().for_each(|k| counts[folds[*k]] += 1);
        assert!(counts.iter().all(|c| (2..=3).contains(c)), "{counts:?}");
    }
}

#[test]
fn folds_keep_grasps_that_follow_each_other_together() {
    let mut data = made_up(12, 6);
    // Without successions each grasp is drawn by itself.
    let (mut random, mut expected) = (ChaCha8Rng::seed_from_u64(2), vec![0; data.examples.len()]);
    for (class, mut members) in data.by_class().into_iter().enumerate() {
        members.shuffle(&mut random);
        members.into_iter().enumerate().for_each(|(n, k)| expected[k] = (n + class) % 4);
    }
    assert_eq!(data.folds(4, 2), expected);
    // Three successions of each object but the first, which has one.
    let by_class = data.by_class();
    for (class, members) in by_class.iter().enumerate() {
        for (n, pair) in members.windows(2).enumerate() {
            let anew = class > 0 && (n + 1) % 4 == 0;
            data.examples[pair[1]].after = (!anew).then(|| data.examples[pair[0]].id);
        }
    }
    let folds = data.folds(4, 2);
    let parts = |grasps: &[usize]| grasps.iter().map(|k| folds[*k]).collect::<BTreeSet<_>>().len();
    assert_eq!(parts(&by_class[0]), 4);
    for members in &by_class[1..] {
        assert_eq!(parts(members), 3);
        assert!(members.chunks(4).all(|succession| parts(succession) == 1), "{folds:?}");
    }
}

#[test]
fn more_grasps_do_not_reduce_f1() {
    let (train, test) = (made_up(12, 7), made_up(8, 8));
    let model = trained(method("ids-lstm").expect("in the list"), &train);
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
fn live_recognition_ends_with_the_verdict_on_the_whole_grasp() {
    let train = made_up(10, 9);
    for key in ["ids-lstm-cross", "extra-trees", "random-forest"] {
        let model = trained(method(key).expect("in the list"), &train);
        let model = Model::from_bytes(key, &model.to_bytes().expect("writes")).expect("reads");
        let mut live = model.recogniser.live().expect("is live");
        let before = Pmf::from_weights([0.1, 0.2, 0.3, 0.4]);
        for (example, before) in train.examples.iter().take(5).zip([None, Some(&before), None, Some(&before), None]) {
            live.begin(before);
            let pushed = example.grasp.rows().filter(|(t, row)| live.push(*t, row).is_some()).count();
            assert!(pushed >= 10, "verdicts during the grasp: {pushed}");
            assert_eq!(live.finish(), Some(model.recogniser.recognise(&example.grasp, before)), "{key}");
        }
    }
}

#[test]
fn forests_grow_surer_and_better_during_a_grasp() {
    let (train, test) = (made_up(20, 9), made_up(20, 10));
    let fitting = Fitting { quick: false, ..quick(1) };
    let model = method("extra-trees").expect("in the list").train(&train, &fitting).expect("fits");
    let mut live = model.recogniser.live().expect("is live");
    let mut right_and_sure = |share: f32| {
        let of = |example: &Example| {
            live.begin(None);
            let end = share * example.grasp.t_s.last().copied().unwrap_or_default();
            let rows = example.grasp.rows().take_while(|(t, _)| *t <= end);
            let answer = rows.filter_map(|(t, row)| live.push(t, row)).last().expect("answers");
            let (class, p) = answer.pmf.top();
            (f64::from(u8::from(class == example.class)), p)
        };
        let answers: Vec<(f64, f64)> = test.examples.iter().map(of).collect();
        let count = answers.len() as f64;
        [answers.iter().map(|own| own.0).sum::<f64>() / count, answers.iter().map(|own| own.1).sum::<f64>() / count]
    };
    let [begun, half, whole] = [0.1, 0.62, 1.0].map(&mut right_and_sure);
    assert!(begun[0] < half[0] && half[0] <= whole[0] && whole[0] > 0.9, "{begun:?} {half:?} {whole:?}");
    assert!(begun[1] < half[1] && half[1] < whole[1], "{begun:?} {half:?} {whole:?}");
    // As sure as right, as far as so few grasps tell.
    assert!([begun, half, whole].iter().all(|own| (own[0] - own[1]).abs() < 0.2), "{begun:?} {half:?} {whole:?}");
}

#[test]
fn unsuitable_data_are_refused_with_a_reason() {
    let data = made_up(6, 10);
    for method in &METHODS {
        let refused = |data: &Dataset| method.train(data, &quick(1)).err().map(|e| e.to_string());
        let only_balls: Vec<usize> = data.by_class()[0].clone();
        let one_class = refused(&data.part(&only_balls)).expect("refused");
        assert!(one_class.contains("only one class, \"ball\""), "{}: {one_class}", method.key);
        assert!(refused(&data.part(&[])).is_some(), "{}", method.key);
        // Two trials of different objects suffice for dtw-knn only.
        let two = refused(&data.part(&[0, 1]));
        assert!(two.is_some_and(|text| text.contains("only 1 of the")) || method.key == "dtw-knn", "{}", method.key);
        let stopped = AtomicBool::new(true);
        let fitting = Fitting { stop: &stopped, ..quick(1) };
        if method.recipe.is_some() {
            assert_eq!(method.train(&data, &fitting).err(), Some(LearnError::Stopped));
            let settings = serde_json::json!({ "unitz": 3 }).as_object().cloned().expect("an object");
            let fitting = Fitting { settings, ..quick(1) };
            let refused = method.train(&data, &fitting).map(|model| model.card).expect_err("refused").to_string();
            assert!(refused.starts_with("setting unitz: "), "{refused}");
        }
    }
    let mut bare = data;
    bare.labels.classes.iter_mut().for_each(|class| (class.size, class.shape) = (None, None));
    let error = method("ds-lstm").expect("in the list").train(&bare, &quick(1)).err();
    assert!(error.is_some_and(|error| error.to_string().contains("learns size and shape first")));
    assert!(method("macro-layer").expect("in the list").train(&bare, &quick(1)).is_ok());
}

#[test]
fn methods_of_two_stages_need_size_and_shape() {
    let mut bare = made_up(6, 10);
    bare.labels.classes.iter_mut().for_each(|class| (class.size, class.shape) = (None, None));
    for method in &METHODS {
        let two_stages = method.recipe.is_some_and(|recipe| recipe().two_stages);
        let refused = method.train(&bare, &quick(1)).err();
        let needs_them = refused.is_some_and(|error| error.to_string().contains("learns size and shape first"));
        assert_eq!(needs_them, two_stages, "{}", method.key);
    }
}

#[test]
fn fingerprints_and_deviations_tell_methods_apart() {
    let prints: BTreeSet<String> = METHODS.iter().map(Method::fingerprint).collect();
    assert_eq!(prints.len(), METHODS.len());
    for method in &METHODS {
        assert_eq!(method.fingerprint().len(), 8, "{}", method.key);
        let strict = method.recipe.is_some_and(|recipe| recipe().strict);
        assert_eq!(method.deviations().is_empty(), strict || method.recipe.is_none(), "{}", method.key);
    }
    let card = trained(method("paper-macro-layer").expect("in the list"), &made_up(4, 1)).card;
    assert_eq!((card.fingerprint.as_deref().map(str::len), card.deviations.as_slice()), (Some(8), [].as_slice()));
    let settings = serde_json::json!({ "noise": 0.1 }).as_object().cloned().expect("an object");
    let fitting = Fitting { settings, ..quick(1) };
    let changed = method("paper-macro-layer").expect("in the list").train(&made_up(4, 1), &fitting).expect("fits");
    assert!(matches!(&changed.card.deviations[..], [one] if one.contains("noise")), "{:?}", changed.card.deviations);
    let of = |changes: serde_json::Value| {
        let recipe = method("paper-macro-layer").and_then(|method| method.recipe).expect("a network")();
        recipe.deviations_with(changes.as_object().expect("an object")).expect("known settings")
    };
    let changed = of(serde_json::json!({ "dropout": 0.2, "epochs": 60, "rate_hz": 75, "units": 16 }));
    assert_eq!(changed, ["dropout to 0.2", "units to 16"].map(|one| format!("sets {one}, unlike the strict network")));
    let tuned = of(serde_json::json!({ "strict": false }));
    assert!(tuned[0].contains("strict to false") && tuned.len() > 2, "{tuned:?}");
}

#[test]
fn each_stage_learns_from_grasps_of_its_own() {
    let (first, second) = (made_up(6, 20), made_up(6, 21));
    for key in ["paper-ds-lstm", "paper-ids-lstm", "ds-lstm"] {
        let stages = |first: &Dataset, second: &Dataset| {
            let fitting = Fitting { second: Some(second), ..quick(1) };
            let model = method(key).expect("in the list").train(first, &fitting).expect("fits");
            assert_eq!(model.card.data.grasps, 48, "the card counts both sets");
            let (one, two): (Vec<_>, Vec<_>) =
                model.recogniser.arrays().0.into_iter().partition(|(name, _)| name.starts_with("stage_one"));
            (one, two)
        };
        let usual = stages(&first, &second);
        let other_second = stages(&first, &second.with_shuffled_labels(1));
        assert!(usual.0 == other_second.0 && usual.1 != other_second.1, "{key}");
        let other_first = stages(&first.with_shuffled_labels(1), &second);
        assert!(usual.0 != other_first.0, "{key}");
    }
}

#[test]
fn methods_of_one_stage_learn_from_both_sets() {
    let (first, second) = (made_up(6, 20), made_up(6, 21));
    let both = Dataset { examples: [&first.examples[..], &second.examples[..]].concat(), ..first.clone() };
    for key in ["random-forest", "paper-macro-layer", "macro-layer", "ds-lstm-cross", "convolution"] {
        let method = method(key).expect("in the list");
        let with_second = method.train(&first, &Fitting { second: Some(&second), ..quick(1) }).expect("fits");
        let joined = method.train(&both, &quick(1)).expect("fits");
        assert!(with_second.recogniser.arrays() == joined.recogniser.arrays(), "{key}");
        let other = Dataset { channels: vec!["grip".to_owned(); 4], ..second.clone() };
        let refused = method.train(&first, &Fitting { second: Some(&other), ..quick(1) }).err();
        assert!(refused.is_some_and(|error| error.to_string().contains("other channels or labels")), "{key}");
    }
}

#[test]
fn the_strict_iterated_network_reads_the_earlier_pmf() {
    let (train, test) = (made_up(60, 1), made_up(5, 2));
    let model = trained(method("paper-ids-lstm").expect("in the list"), &train);
    assert!(model.recogniser.live().is_none(), "stage one decides after the whole grasp");
    // Mean probability of the true class where the earlier grasp named the class that is some places further.
    let given = |further: usize| {
        let of_grasp = |example: &Example| {
            let named = (example.class + further) % 4;
            let before = Pmf::from_weights((0..4).map(|k| if k == named { 0.97 } else { 0.01 }));
            model.recogniser.recognise(&example.grasp, Some(&before)).pmf.probabilities()[example.class]
        };
        test.examples.iter().map(of_grasp).sum::<f64>() / test.examples.len() as f64
    };
    // The next class is the one most easily taken for it.
    assert!(given(0) > given(1) + 0.01, "{} against {}", given(0), given(1));
}

#[test]
fn votes_of_trees_are_calibrated() {
    let (train, test) = (made_up(25, 1), made_up(25, 2));
    for key in ["random-forest", "extra-trees", "rusboost", "decision-tree"] {
        let model = trained(method(key).expect("in the list"), &train);
        let answers = answer(model.recogniser.as_ref(), &test);
        let probabilities: Vec<Vec<f64>> =
            answers.verdicts.iter().map(|verdict| verdict.pmf.probabilities().to_vec()).collect();
        let forecasts = crate::metrics::Forecasts::new(&answers.truth, &probabilities).expect("has trials");
        let error = forecasts.calibration_error(crate::metrics::CALIBRATION_BINS);
        assert!(error < 0.1, "{key}: calibration error {error}");
    }
}

#[test]
fn truncated_or_altered_models_are_refused() {
    let data = made_up(6, 11);
    for method in &METHODS {
        let model = trained(method, &data);
        let bytes = model.to_bytes().expect("writes");
        for part in 0..24 {
            let cut = bytes.len() * part / 24;
            assert!(Model::from_bytes("cut", &bytes[..cut]).is_err(), "{} cut at {cut}", method.key);
        }
        // A card with other channels, or an unknown method.
        let with = |change: &dyn Fn(&mut ModelCard)| {
            let mut altered = model.clone();
            change(&mut altered.card);
            Model::from_bytes("altered", &altered.to_bytes().expect("writes"))
        };
        assert!(with(&|card| card.channels.push("grip".to_owned())).is_err(), "{}", method.key);
        assert!(with(&|card| card.settings = serde_json::Value::Null).is_err(), "{}", method.key);
        let unknown = with(&|card| card.method = "oracle".to_owned());
        let unknown = unknown.expect_err("unknown").to_string();
        assert!(unknown.contains("uses the method \"oracle\", which this version does not know"), "{unknown}");
        let removed = with(&|card| card.method = "committee".to_owned()).expect_err("removed").to_string();
        assert!(removed.contains("\"committee\", which was removed after version 0.1.0"), "{removed}");
        let other = ["curvature_left", "curvature_right", "force_left", "grip"].map(str::to_owned);
        let text = model.check_channels(&other).expect_err("other channels").to_string();
        assert!(text.contains("needs force_right") && text.contains("does not know grip"), "{text}");
    }
}

#[test]
fn shipped_models_are_live_know_other_objects_and_learn_new_ones() {
    for shipped in Shipped::ALL {
        let model = shipped.model().expect("valid");
        assert!(model.recogniser.live().is_some() && model.card.labels.other().is_some(), "{shipped:?}");
        assert!(model.learns_new_objects() && !model.card.quick, "{shipped:?}: a quick model must not ship");
        let (prior, other) = (model.card.prior().expect("knows others"), model.card.labels.other().expect("known"));
        let known = 2.0 / 3.0 / (prior.classes() - 1) as f64;
        let wanted = |class: usize| if class == other { 1.0 / 3.0 } else { known };
        assert!((0..prior.classes()).all(|class| (prior.probabilities()[class] - wanted(class)).abs() < 1e-12));
        let mut card = model.card;
        card.labels.classes.remove(other);
        assert_eq!(card.prior(), None);
    }
}

/// Models of every method, trained by version 0.1.0 on `made_up(3, 1)` (dual-stage networks: `made_up(5, 1)`), with their
/// PMFs of `made_up(1, 2)` in `expected.json`.
const SAVED: &[(&str, &[u8])] = &[
    ("ds-lstm", include_bytes!("saved_models/ds-lstm.safetensors")),
    ("ids-lstm", include_bytes!("saved_models/ids-lstm.safetensors")),
    ("ds-lstm-cross", include_bytes!("saved_models/ds-lstm-cross.safetensors")),
    ("ids-lstm-cross", include_bytes!("saved_models/ids-lstm-cross.safetensors")),
    ("macro-layer", include_bytes!("saved_models/macro-layer.safetensors")),
    ("paper-macro-layer", include_bytes!("saved_models/paper-macro-layer.safetensors")),
    ("paper-ds-lstm", include_bytes!("saved_models/paper-ds-lstm.safetensors")),
    ("paper-ids-lstm", include_bytes!("saved_models/paper-ids-lstm.safetensors")),
    ("zuo", include_bytes!("saved_models/zuo.safetensors")),
    ("decision-tree", include_bytes!("saved_models/decision-tree.safetensors")),
    ("knn", include_bytes!("saved_models/knn.safetensors")),
    ("svm", include_bytes!("saved_models/svm.safetensors")),
    ("lstm", include_bytes!("saved_models/lstm.safetensors")),
    ("random-forest", include_bytes!("saved_models/random-forest.safetensors")),
    ("bagged-trees", include_bytes!("saved_models/bagged-trees.safetensors")),
    ("gradient-boosting", include_bytes!("saved_models/gradient-boosting.safetensors")),
    ("rusboost", include_bytes!("saved_models/rusboost.safetensors")),
    ("extra-trees", include_bytes!("saved_models/extra-trees.safetensors")),
    ("geometry-trees", include_bytes!("saved_models/geometry-trees.safetensors")),
    ("geometry-network", include_bytes!("saved_models/geometry-network.safetensors")),
    ("dtw-knn", include_bytes!("saved_models/dtw-knn.safetensors")),
    ("convolution", include_bytes!("saved_models/convolution.safetensors")),
];

#[test]
fn saved_models_still_load_with_the_same_results() {
    let expected: std::collections::BTreeMap<String, Vec<Vec<f64>>> =
        serde_json::from_str(include_str!("saved_models/expected.json")).expect("valid JSON");
    assert!(METHODS.iter().map(|method| method.key).eq(SAVED.iter().map(|(key, _)| *key)), "a model of every method");
    let test = made_up(1, 2);
    for (key, bytes) in SAVED {
        let model = Model::from_bytes(key, bytes).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(model.card.parameters, model.recogniser.parameters(), "{key}");
        assert!(model.to_bytes().expect("encodes") == *bytes, "{key} is saved as it was");
        for (example, expected) in test.examples.iter().zip(&expected[*key]) {
            let pmf = model.recogniser.recognise(&example.grasp, None).pmf;
            let differs = pmf.probabilities().iter().zip(expected).any(|(p, e)| (p - e).abs() > 1e-5);
            assert!(!differs, "{key}: {pmf:?} instead of {expected:?}");
        }
    }
}

#[test]
fn damaged_signatures_are_refused_and_absent_ones_change_no_answer() {
    let (_, bytes) = SAVED[4];
    let old = Model::from_bytes("old", bytes).expect("valid");
    assert!(old.signatures.is_none() && old.card.signature_grasps.is_none());
    let data = made_up(3, 1);
    let with = old.clone().with_signatures(Signatures::of(&data));
    let encoded = with.to_bytes().expect("encodes");
    let loaded = Model::from_bytes("with", &encoded).expect("valid");
    assert_eq!((&loaded.signatures, &loaded.card), (&with.signatures, &with.card));
    for example in &data.examples {
        let [before, after] = [&old, &loaded].map(|model| model.recogniser.recognise(&example.grasp, None));
        assert_eq!(before, after);
    }
    // Signatures without their entry on the card, with another number of classes, or without the arrays.
    let mut altered = with.clone();
    altered.card.signature_grasps = None;
    let text = Model::from_bytes("altered", &altered.to_bytes().expect("encodes")).expect_err("refused").to_string();
    assert!(text.contains("signatures/mean"), "{text}");
    altered.card.signature_grasps = Some(vec![3; 3]);
    let text = Model::from_bytes("altered", &altered.to_bytes().expect("encodes")).expect_err("refused").to_string();
    assert!(text.contains("grasps in the signatures"), "{text}");
    let mut none = old.clone();
    none.card.signature_grasps = Some(vec![3; 4]);
    let text = Model::from_bytes("none", &none.to_bytes().expect("encodes")).expect_err("refused").to_string();
    assert!(text.contains("signatures/t_s\" is missing"), "{text}");
}

/// Decodes a model after a change of its arrays.
fn with_arrays(bytes: &[u8], change: impl FnOnce(&mut crate::Arrays)) -> Result<Model, ModelError> {
    let model = Model::from_bytes("original", bytes)?;
    let mut arrays = model.recogniser.arrays();
    change(&mut arrays);
    let card = serde_json::to_string(&model.card).expect("encodes");
    let header = std::collections::HashMap::from([("palpate".to_owned(), card)]);
    Model::from_bytes("changed", &safetensors::serialize(&arrays.0, Some(header)).expect("encodes"))
}

#[test]
fn damaged_arrays_are_refused_by_name_and_shape() {
    let invalid = |cause: &str| ModelError::invalid("changed", &ModelError(cause.to_owned()));
    for (key, bytes) in SAVED {
        let names: Vec<String> =
            Model::from_bytes(key, bytes).expect("valid").recogniser.arrays().0.keys().cloned().collect();
        let refused = |name: &str, what: &str, change: &dyn Fn(&mut crate::Array)| {
            let result = with_arrays(bytes, |arrays| change(arrays.0.get_mut(name).expect("in the file")));
            match result {
                Err(ModelError(text)) => {
                    let is_of_array = text.contains("array") && text.contains(&format!("\"{name}\""));
                    assert!(is_of_array, "{key}, {name} {what}: {text}");
                    text
                }
                Ok(_) => panic!("{key}, {name} {what}: read"),
            }
        };
        for name in &names {
            let missing = with_arrays(bytes, |arrays| drop(arrays.0.remove(name)));
            assert_eq!(missing.err(), Some(invalid(&format!("array \"{name}\" is missing"))));

            let mut shape = Vec::new();
            with_arrays(bytes, |arrays| shape.clone_from(&arrays.0[name].shape)).expect("unchanged");
            shape.insert(0, 1);
            let error = refused(name, "with another axis", &|array| array.shape.insert(0, 1));
            let other = |word: &str| error.contains(word) && !error.contains(&format!("{word}{shape:?}"));
            let is_shape =
                error.contains(&format!("has shape {shape:?}")) && (other("instead of ") || other("requires "));
            assert!(is_shape, "{key}: {error}");

            refused(name, "with a repeated first element or row", &|array| {
                let row: usize = array.shape[1..].iter().product();
                array.shape[0] += 1;
                match &mut array.numbers {
                    Numbers::F32(values) => values.extend_from_within(..row),
                    Numbers::F64(values) => values.extend_from_within(..row),
                    Numbers::I64(values) => values.extend_from_within(..row),
                    Numbers::I16(values) => values.extend_from_within(..row),
                }
            });
            refused(name, "without its last element or row", &|array| {
                let row: usize = array.shape[1..].iter().product();
                array.shape[0] -= 1;
                match &mut array.numbers {
                    Numbers::F32(values) => values.truncate(values.len() - row),
                    Numbers::F64(values) => values.truncate(values.len() - row),
                    Numbers::I64(values) => values.truncate(values.len() - row),
                    Numbers::I16(values) => values.truncate(values.len() - row),
                }
            });
            refused(name, "of another type", &|array| {
                array.numbers = match &array.numbers {
                    Numbers::F32(values) => Numbers::I64(vec![0; values.len()]),
                    Numbers::F64(values) => Numbers::F32(vec![0.0; values.len()]),
                    Numbers::I64(values) => Numbers::F64(vec![0.0; values.len()]),
                    Numbers::I16(values) => Numbers::F32(vec![0.0; values.len()]),
                };
            });
            let is_small =
                Model::from_bytes(key, bytes).expect("valid").recogniser.arrays().0[name].numbers.kind() == "i16";
            for number in [f64::NAN, f64::INFINITY].into_iter().filter(|_| !is_small) {
                let change = |array: &mut crate::Array| match &mut array.numbers {
                    Numbers::F32(values) => values[0] = number as f32,
                    Numbers::F64(values) => values[0] = number,
                    // Integers are always finite; a huge one is out of range.
                    Numbers::I64(values) => values[0] = i64::MAX,
                    // Every small integer is in range.
                    Numbers::I16(_) => {}
                };
                let error = refused(name, "with a number that is not finite", &change);
                assert!(error.contains(": element "), "{key}: {error}");
            }
        }
        let extra = with_arrays(bytes, |arrays| arrays.put("extra", &[2], vec![0.0; 2]));
        assert_eq!(extra.err(), Some(invalid("array \"extra\" of shape [2] is not part of this method")), "{key}");
    }
}
