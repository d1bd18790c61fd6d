//! A study of your own: how hard objects are held, over the friction of their surface. Cells are computed in parallel and kept in
//! a file, so that the same command continues after Ctrl+C:
//! `cargo run --release -p palpate-study --example own_study -- friction.jsonl`.

#![expect(clippy::print_stdout, reason = "an example that says what it did")]

use palpate_lab::grasping::{GraspSummary, Shard, grasp};
use palpate_sim::scene::{Auto, Scene};
use palpate_study::{
    Cell, Experiment, LinkedFigure, Measuring, StudyCell, StudyColumn, StudyCommand, StudyError, StudyReport, StudyRow,
    StudyTable, run_experiment,
};
use std::path::Path;
use std::sync::atomic::AtomicBool;

const OBJECTS: [&str; 3] = ["lemon", "cube", "cylinder"];
const FRICTION: [f64; 4] = [0.2, 0.4, 0.6, 0.8];

struct HoldForce;

/// Cell of the grid: one grasp.
struct OneGrasp {
    object: &'static str,
    friction: f64,
}

impl StudyCell for OneGrasp {
    fn name(&self) -> String {
        format!("{} {}", self.object, self.friction)
    }
}

impl Experiment for HoldForce {
    type Cell = OneGrasp;
    /// Normal force on both pads (N).
    type Found = f64;
    type Report = StudyReport;

    fn key(&self) -> &'static str {
        "hold-force"
    }

    fn header(&self) -> serde_json::Value {
        serde_json::json!({ "scene": "default" })
    }

    fn command(&self) -> StudyCommand {
        StudyCommand::new(self.key())
    }

    fn grid(&self) -> Vec<OneGrasp> {
        OBJECTS.into_iter().flat_map(|object| FRICTION.map(|friction| OneGrasp { object, friction })).collect()
    }

    fn measure(&self, cell: &OneGrasp, _stop: &AtomicBool) -> Result<f64, StudyError> {
        let mut scene = Scene::default();
        cell.object.clone_into(&mut scene.object.source);
        scene.object.friction = Auto::Value(cell.friction);
        let object = scene.load_object()?;
        let summary = GraspSummary::new(&grasp(&scene, object.as_ref(), 0), &scene);
        Ok(summary.hold.map_or(0.0, |hold| hold.force_n.iter().sum()))
    }

    fn report(&self, found: Vec<(OneGrasp, f64)>) -> StudyReport {
        let column = |name: &str, unit: &str| StudyColumn { name: name.to_owned(), unit: unit.to_owned() };
        let row = |(cell, force): &(OneGrasp, f64)| StudyRow {
            cells: vec![Cell::Text(cell.object.to_owned()), Cell::Number(cell.friction), Cell::Number(*force)],
            trials: Vec::new(),
            sensors: None,
        };
        let table = StudyTable {
            name: "hold".to_owned(),
            title: "Force in the hold".to_owned(),
            columns: vec![column("object", ""), column("friction", ""), column("force", "N")],
            rows: found.iter().map(row).collect(),
        };
        StudyReport { fingerprint: String::new(), data: Vec::new(), tables: vec![table], findings: Vec::new() }
    }

    fn shown(report: &StudyReport) -> StudyReport {
        report.clone()
    }

    fn figures(_report: &StudyReport) -> Vec<LinkedFigure> {
        Vec::new()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = std::env::args().nth(1);
    let stop = AtomicBool::new(false);
    let how = Measuring { threads: 2, cancelled: &stop, progress: &|_| () };
    let outcome = run_experiment(&HoldForce, &how, file.as_deref().map(Path::new), Shard::WHOLE)?;
    let study = outcome.whole().ok_or("stopped")?;
    study.result.tables.iter().for_each(|table| println!("{}:\n\n{}", table.title, table.markdown()));
    Ok(())
}
