//! Stored results of studies, and the tables and pictures that are made from them.

use palpate_geometry::palette::Theme;
use palpate_lab::grasping::Shard;
use palpate_render::figure_svg;
use palpate_store::Store;
use palpate_study::accuracy::stored_accuracy;
use palpate_study::paper::{
    PAPER_STUDIES, PaperStudy, StudyData, StudyPlan, is_current, paper_study, study_fingerprint,
};
use palpate_study::{
    Cell, FigureMark, Measuring, ShownStudy, StoredStudy, StudyError, StudyOutcome, StudyProgress, StudyReport,
    StudyRow, StudySize, StudyStep, generated_sections, merged_units, program,
};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

type TestResult = Result<(), Box<dyn std::error::Error>>;

#[test]
fn tables_in_manual_and_readme_are_those_of_the_stored_results() -> TestResult {
    for section in generated_sections()? {
        let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(section.document))?;
        let written = section.put_into(&text).ok_or_else(|| format!("{} has no {}", section.document, section.name))?;
        assert!(written == text, "{}: run `cargo run -p palpate-workshop -- tables`", section.document);
    }
    Ok(())
}

#[test]
fn results_stored_for_the_page_of_the_paper_are_of_this_version() -> TestResult {
    for study in PAPER_STUDIES {
        let Some(ShownStudy { stored, .. }) = study.shipped()? else { continue };
        let key = study.card().key;
        assert_eq!(stored.program, program(), "{key}: run the study again");
        assert!(!stored.origin().contains("not repeated with"), "{key}");
        let plan = StudyPlan::of_size(StudySize::Full);
        let today = study_fingerprint(*study, &plan);
        assert!(is_current(&stored.result, *study, &plan), "{key}: other recognisers ({today}); run the study again");
    }
    Ok(())
}

#[test]
fn the_stored_picture_is_that_of_the_stored_result() -> TestResult {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/studies/accuracy.svg");
    let stored = stored_accuracy().expect("stored");
    let linked = stored.result.figure().with_note(&stored.plain_origin());
    let drawn = figure_svg(&linked.figure, Theme::Light, linked.size)?;
    assert!(std::fs::read_to_string(path)? == drawn, "run `palpate study accuracy --out assets/studies` again");
    Ok(())
}

/// Runs a study on a sample: four objects, six grasps of each. It is stopped once that many units are done.
fn sample(
    study: &dyn PaperStudy,
    folder: &Path,
    threads: usize,
    stop_after: Option<usize>,
) -> Result<Option<StoredStudy<StudyReport>>, StudyError> {
    let plan = StudyPlan::of_size(StudySize::Sample { objects: 4, trials: 6 });
    let cancelled = AtomicBool::new(false);
    let progress = |progress: StudyProgress| {
        if progress.step == StudyStep::Measuring && stop_after.is_some_and(|most| progress.done >= most) {
            cancelled.store(true, Ordering::Relaxed);
        }
    };
    let store = Store::open(&folder.join("store.sqlite")).expect("opens");
    let work = Measuring { threads, cancelled: &cancelled, progress: &progress };
    let results = stop_after.map(|_| folder.join(format!("{}.jsonl", study.card().key)));
    let outcome = study.run(&StudyData::new(store, &plan, work), results.as_deref(), Shard::WHOLE)?;
    Ok(outcome.whole())
}

/// Lines of finished units without the CPU time that each took.
fn without_cpu_time(text: &str) -> String {
    let line = |line: &str| match line.split_once("\"cpu_s\":") {
        Some((before, after)) => format!("{before}{}\n", after.split_once(',').map_or("", |(_, rest)| rest)),
        None => format!("{line}\n"),
    };
    text.lines().map(line).collect()
}

#[test]
fn eight_parts_of_a_study_merge_into_the_file_of_one_machine() -> TestResult {
    let folder = tempfile::tempdir()?;
    let study = paper_study("grasps").expect("a study");
    let plan = StudyPlan::of_size(StudySize::Sample { objects: 3, trials: 6 });
    let cancelled = AtomicBool::new(false);
    // Each machine has a store of its own.
    let machine = |name: &str, progress: &(dyn Fn(StudyProgress) + Sync), run: &dyn Fn(&StudyData<'_>, &Path)| {
        let store = Store::open(&folder.path().join(format!("{name}.sqlite"))).expect("opens");
        let work = Measuring { threads: 1, cancelled: &cancelled, progress };
        let file = folder.path().join(format!("{name}.jsonl"));
        run(&StudyData::new(store, &plan, work), &file);
        file
    };
    let whole = |bench: &StudyData<'_>, file: &Path| {
        let stored = study.run(bench, Some(file), Shard::WHOLE).expect("runs").whole().expect("finished");
        std::fs::write(file.with_extension("json"), serde_json::to_string(&stored.result).expect("writes"))
            .expect("writes");
    };
    let one = machine("one", &|_| (), &whole);
    let parts: Vec<PathBuf> = (1..=8)
        .map(|number| {
            let shard: Shard = format!("{number}/8").parse().expect("a part");
            let part = |bench: &StudyData<'_>, file: &Path| {
                let outcome = study.run(bench, Some(file), shard).expect("runs");
                assert!(matches!(outcome, StudyOutcome::Part(0 | 1)), "{outcome:?}");
            };
            machine(&format!("part{number}"), &|_| (), &part)
        })
        .collect();
    let (merged, units) = merged_units(&parts)?;
    assert_eq!(units, study.units(&plan).len());
    // The CPU time of a unit is that of the part that measured it; all else is the same, byte for byte.
    assert_eq!(without_cpu_time(&merged), without_cpu_time(&merged_units(&[one])?.0));
    let file = folder.path().join("merged.jsonl");
    std::fs::write(&file, &merged)?;
    let nothing_left = |progress: StudyProgress| assert_eq!(progress.done, progress.of);
    machine("merged", &nothing_left, &whole);
    let result = |name: &str| std::fs::read_to_string(folder.path().join(name));
    assert!(result("merged.json")? == result("one.json")?);
    // Parts whose stores number the same grasps otherwise do not fit together.
    let (text, trials) = (std::fs::read_to_string(&parts[1])?, "\"trials\":{\"");
    let (before, after) = text.rsplit_once(trials).ok_or("the end of a part")?;
    let (name, rest) = after.split_once("\":\"").ok_or("a number")?;
    std::fs::write(&parts[1], format!("{before}{trials}{name}\":\"0{rest}"))?;
    let refused = merged_units(&parts).expect_err("other numbers").to_string();
    assert!(refused.contains("part2.jsonl") && refused.contains("copies of one store"), "{refused}");
    Ok(())
}

/// The tables without columns of CPU times, which differ from run to run.
fn without_times(report: &StudyReport) -> Vec<(String, Vec<StudyRow>)> {
    let tables = report.tables.iter().map(|table| {
        let is_time = |at: usize| ["CPU s", "µs", "ms"].contains(&table.columns[at].unit.as_str());
        let cells = |cells: &[Cell]| (0..cells.len()).filter(|at| !is_time(*at)).map(|at| cells[at].clone()).collect();
        let row = |row: &StudyRow| StudyRow { cells: cells(&row.cells), ..row.clone() };
        (table.name.clone(), table.rows.iter().map(row).collect())
    });
    tables.collect()
}

#[test]
fn studies_of_the_paper_run_resume_and_repeat() -> TestResult {
    let folder = tempfile::tempdir()?;
    let mut frozen = String::new();
    for study in PAPER_STUDIES {
        let card = study.card();
        assert!(sample(*study, folder.path(), 2, Some(1))?.is_none(), "{}: stopped after a unit", card.key);
        let stored = sample(*study, folder.path(), 2, Some(usize::MAX))?.expect("finished");
        let report = &stored.result;
        frozen += &crate::frozen::study(&stored);
        assert!(!report.data.is_empty() && !report.tables.is_empty(), "{}: {report:?}", card.key);
        assert!(report.data.iter().all(|line| line.contains("preset")), "{}: {:?}", card.key, report.data);
        for table in &report.tables {
            assert!(!table.rows.is_empty(), "{}: {} is empty", card.key, table.name);
            assert!(table.rows.iter().all(|row| row.cells.len() == table.columns.len()), "{}", table.name);
            assert!(table.csv().lines().count() == table.rows.len() + 1, "{}", table.name);
        }
        assert!(report.tables.iter().any(|table| table.rows.iter().any(|row| !row.trials.is_empty())), "{}", card.key);
        assert!(report.findings.is_empty() != card.is_of_the_paper(), "{} has findings", card.key);
        for finding in &report.findings {
            assert!(finding.section.starts_with('V') && !finding.why.is_empty(), "{finding:?}");
        }
        let figures = study.figures(report);
        assert!(!figures.is_empty(), "{} has figures", card.key);
        for linked in &figures {
            assert!(!linked.links.is_empty(), "{}: marks lead to trials", linked.name);
            for link in &linked.links {
                let plot = &linked.figure.plots[link.plot];
                let is_there = match link.mark {
                    FigureMark::Point(series, point) => plot.series[series].points.len() > point,
                    FigureMark::Cell(row, column) => {
                        plot.heat.as_ref().is_some_and(|h| h.y.count > row && h.x.count > column)
                    }
                };
                assert!(is_there && report.tables[link.table].rows.len() > link.row, "{}: {link:?}", linked.name);
            }
            figure_svg(&linked.figure, Theme::Dark, linked.size)?;
        }
        let again = sample(*study, folder.path(), 1, None)?.expect("finished");
        assert_eq!(without_times(&again.result), without_times(report), "{} on one thread", card.key);
    }
    crate::frozen::compare_numbers("studies", &frozen);
    Ok(())
}
