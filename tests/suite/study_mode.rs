//! Study mode: a study is run, stopped and resumed in the window, and a point of its figure opens its trials.

use crate::bench::{Bench, BenchSetup};
use crate::cpu_renderer::CpuRenderer;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use image::RgbaImage;
use palpate::app::Mode;
use palpate_geometry::palette::Theme;
use palpate_lab::datasets::SensorView;
use palpate_learn::metrics::Interval;
use palpate_store::Store;
use palpate_study::jobs::StudyRequest;
use palpate_study::paper::{StudyPlan, paper_study, study_fingerprint};
use palpate_study::{
    Agreement, Cell, ClaimNumber, Finding, PERCENT, POINTS, StoredStudy, StudyReport, StudySize, StudyTable,
};
use palpate_tactile::model::SensorModel;

const SAMPLE: StudySize = StudySize::Sample { objects: 4, trials: 6 };

fn request(anew: bool) -> StudyRequest {
    StudyRequest { key: "models".to_owned(), size: SAMPLE, anew }
}

/// A made-up result of the study `models`, whose numbers repeat.
pub(crate) fn scripted_result(store: &mut Store) {
    let columns = [("grasps", ""), ("model", ""), ("kind", ""), ("F1", PERCENT), ("training", "CPU s")];
    let mut table = StudyTable::new("models", "Methods on grasps that none has seen, preset B", &columns);
    for kind in ["virtual", "physical-like"] {
        let models =
            [("extra-trees", "ensemble", 0.83), ("macro-layer", "network", 0.79), ("svm", "single model", 0.64)];
        for (k, (model, group, f1)) in models.into_iter().enumerate() {
            let f1 = if kind == "virtual" { f1 } else { f1 - 0.3 };
            let interval = Interval { estimate: f1, low: f1 - 0.04, high: f1 + 0.03 };
            let cells = [kind, model, group].map(Cell::text).to_vec();
            let cells = [cells, vec![Cell::Interval(interval), Cell::Number(3.0 / (k + 1) as f64)]].concat();
            table.push(cells, vec![k as i64 + 1, 1]);
            let sensors = SensorModel::ALL.into_iter().find(|own| own.name() == kind).expect("a sensor model");
            let view = SensorView { sensors, ..SensorView::default() };
            table.rows.iter_mut().last().expect("pushed").sensors = Some(view);
        }
    }
    let gain = |low: f64, high: f64| Some(Interval { estimate: 0.5 * (low + high), low, high });
    let finding =
        |section: &str, claim: &str, found: &str, verdict: Agreement, measured: &[(&str, f64, f64)]| Finding {
            section: section.to_owned(),
            claim: claim.to_owned(),
            found: found.to_owned(),
            measured: measured
                .iter()
                .map(|(what, low, high)| ClaimNumber::new(*what, gain(*low, *high), POINTS, 0.0))
                .collect(),
            verdict,
            why: "Agrees where every interval of the difference lies above zero".to_owned(),
        };
    let findings = vec![
        finding(
            "V-D",
            "Ensembles are best",
            "Every interval lies above the line.",
            Agreement::Agrees,
            &[("extra-trees over macro-layer", 0.01, 0.07), ("extra-trees over svm", 0.15, 0.23)],
        ),
        finding(
            "V-D",
            "The SVM is as good as networks",
            "Intervals lie below the line.",
            Agreement::Disagrees,
            &[("svm over macro-layer", -0.19, -0.11)],
        ),
        finding(
            "VI",
            "It costs less",
            "Some do, others do not.",
            Agreement::Partly,
            &[("svm over trees", -0.02, 0.03)],
        ),
        finding("VI", "It is small", "", Agreement::NotMeasured, &[]),
    ];
    let data = vec!["virtual sensors: 320 grasps of 16 objects, preset B, layout C1".to_owned()];
    let fingerprint = study_fingerprint(paper_study("models").expect("known"), &StudyPlan::of_size(StudySize::Quick));
    let report = StudyReport { fingerprint, data, tables: vec![table], findings };
    let mut stored = StoredStudy::new("palpate study models --quick", 0.25, report);
    // Programs of other versions have the same picture.
    stored.program = "0.0.0, physics 0".to_owned();
    let folder = StudySize::Quick.folder(store.path());
    std::fs::create_dir_all(folder.path()).expect("makes the folder");
    stored.write(&folder.path().join("models.json")).expect("writes");
}

fn bench(theme: Theme, size: [f32; 2], fill: fn(&mut Store)) -> Bench {
    let mut bench = Bench::new(BenchSetup { theme, size, fill, ..BenchSetup::default() }, CpuRenderer::default());
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Num4);
    bench.harness.run_steps(2);
    assert_eq!(bench.workbench().view().mode, Mode::Study);
    bench.tell(|app| app.studies.choose("models"));
    bench
}

/// Moves the pointer over a plot until a text is there.
fn point_at(bench: &mut Bench, plot: &str, text: &str) -> egui::Pos2 {
    let rect = bench.harness.get_by_label_contains(plot).rect();
    for row in 0..40 {
        for column in 0..40 {
            let at = rect.min + rect.size() * egui::vec2((column as f32 + 0.5) / 40.0, (row as f32 + 0.5) / 40.0);
            bench.harness.hover_at(at);
            bench.harness.run_steps(2);
            if bench.harness.query_all_by_label_contains(text).next().is_some() {
                return at;
            }
        }
    }
    panic!("{text} is nowhere in {plot}");
}

fn until_open(bench: &mut Bench) -> i64 {
    for _ in 0..3000 {
        if let Some(open) = bench.workbench().inspected() {
            return open.trial.id;
        }
        bench.wait();
    }
    panic!("no trial is open: {:?}", bench.workbench().messages());
}

#[test]
fn a_study_is_run_stopped_resumed_and_its_trials_are_opened() {
    let mut bench = bench(Theme::Dark, [1600.0, 1800.0], |_| ());
    bench.until_shown(true, "shipped result");
    bench.tell(|app| app.run_study(request(false)));
    bench.until_shown(true, "measuring, ");
    bench.harness.get_by_label("Stop study").click();
    bench.until_told("Study stopped: ");
    bench.until_shown(true, "shipped result; your run is paused");
    bench.tell(|app| app.run_study(request(false)));
    bench.until_told("Study finished: ");
    bench.until_shown(true, "Quick run: do not quote.");
    // The same files as those of the command line.
    let folder = SAMPLE.folder(bench.store().path());
    let stored = folder.read::<StudyReport>("models").unwrap().expect("a result");
    assert!(stored.result.tables.iter().any(|table| table.rows.iter().any(|row| !row.trials.is_empty())));
    assert!(folder.has_begun("models") && folder.path().join("models.svg").is_file());
    let at = point_at(&mut bench, "Cost: ", "Click to open trial");
    bench.harness.drag_at(at);
    bench.harness.drop_at(at);
    bench.harness.run_steps(2);
    let opened = until_open(&mut bench);
    assert_eq!(bench.workbench().view().mode, Mode::Inspect);
    let of_a_row =
        stored.result.tables.iter().flat_map(|table| &table.rows).any(|row| row.trials.first() == Some(&opened));
    assert!(of_a_row, "trial {opened} is the first of a row");
}

#[test]
fn findings_are_told_by_words_and_rows_open_trials() {
    let fill = |store: &mut Store| {
        crate::inspect::three_trials(store);
        scripted_result(store);
    };
    let mut bench = bench(Theme::Light, [1400.0, 1000.0], fill);
    bench.until_shown(true, "4 claims: agrees 1, partly 1, disagrees 1, not measured 1");
    for word in ["✔ agrees", "✖ disagrees", "± partly", "– not measured"] {
        assert!(bench.harness.query_by_label(word).is_some(), "{word}");
    }
    let strip = "svm over macro-layer: −15.0 (−19.0 to −11.0) points, line at 0.0\u{a0}points";
    assert!(bench.harness.query_by_label(strip).is_some(), "{strip}");
    bench.harness.run_steps(3);
    assert!(bench.harness.query_by_label_contains("than today's: run the study again").is_some());
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::E);
    bench.harness.run_steps(3);
    assert!(bench.harness.query_by_label("Cancel").is_some(), "the file is asked for");
    bench.harness.get_by_label("Cancel").click();
    bench.harness.run_steps(3);
    let label = "Row virtual, macro-layer, network, 79.0 (75.0 to 82.0), 1.50";
    bench.harness.get_by_label(label).click();
    bench.harness.run_steps(2);
    assert_eq!(until_open(&mut bench), 2);
    bench.until_shown(true, "Lemon, trial 1, simulated");
    // A row is opened through the sensors by which it was measured.
    let through = |bench: &Bench| -> Vec<&str> {
        let shown = bench.workbench().inspected().unwrap();
        let all = std::iter::once(shown.trial).chain(shown.pinned.iter().map(|pinned| &pinned.trial));
        all.map(|trial| trial.sensors.sensors.name()).collect()
    };
    assert_eq!(through(&bench), ["virtual"; 2]);
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Num4);
    bench.harness.run_steps(3);
    bench.harness.get_by_label("Row physical-like, macro-layer, network, 49.0 (45.0 to 52.0), 1.50").click();
    bench.until_told("through physical-like sensors as in the study");
    while through(&bench) != ["physical-like"; 2] {
        bench.wait();
    }
    // All trials of the row are listed, and no others.
    bench.until_shown(true, "trials kept of the row: 2  \u{d7}");
    // Another trial is shown as before, in the whole list.
    bench.tell(|app| app.open_trial(3));
    bench.until_shown(false, "trials kept of the row");
    while through(&bench) != ["virtual"; 2] {
        bench.wait();
    }
}

#[test]
fn units_of_another_plan_are_forgotten_on_request() {
    let fill = |store: &mut Store| {
        let folder = SAMPLE.folder(store.path());
        std::fs::create_dir_all(folder.path()).unwrap();
        std::fs::write(folder.units("models"), "{\"study\":\"models\",\"program\":\"0\",\"plan\":null}\n").unwrap();
    };
    let mut bench = bench(Theme::Dark, [1400.0, 1000.0], fill);
    bench.tell(|app| app.run_study(request(false)));
    bench.until_told("another version");
    bench.until_shown(true, "Begin anew");
    bench.harness.get_by_label("Begin anew").click();
    bench.until_shown(true, "simulating grasps");
    bench.harness.key_press(Key::Delete);
    bench.until_told("Study stopped: ");
}

/// Whole pictures of the mode, to be looked at: `UPDATE_SCREENSHOTS=1` writes them to `screenshots/failed`.
#[test]
fn the_mode_is_drawn_in_both_themes_and_small() {
    for (name, theme, size) in [
        ("study_dark", Theme::Dark, [1280.0, 820.0]),
        ("study_light", Theme::Light, [1280.0, 820.0]),
        ("study_small", Theme::Light, [760.0, 500.0]),
    ] {
        let mut bench = bench(theme, size, scripted_result);
        bench.tell(|app| app.show_panel("study-figure"));
        bench.until_shown(true, " claims: ");
        bench.harness.run_steps(8);
        let picture: RgbaImage = bench.picture();
        assert_eq!([picture.width() as f32, picture.height() as f32], size);
        if std::env::var_os("UPDATE_SCREENSHOTS").is_some() {
            let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("screenshots/failed");
            std::fs::create_dir_all(&folder).unwrap();
            picture.save(folder.join(format!("{name}.png"))).unwrap();
        }
    }
}
