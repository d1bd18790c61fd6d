//! `palpate bench library`: what a person waits for in the trial library, from a command to the view that shows it.

use super::super::Failure;
use super::super::output::TemporaryFolder;
use super::super::terminal::{Column, note};
use super::Costs;
use palpate_lab::grasping::grasp;
use palpate_lab::workers::{LibraryCommand, LibraryView, LibraryWorker};
use palpate_sim::objects::catalogue;
use palpate_sim::scene::{PRESETS, Scene};
use palpate_store::labels::{Flag, TrialEdit};
use palpate_store::{BoardInfo, Day, ImportedTrial, Shown, Store, TrialColumn, TrialOrder, TrialQuality, TrialQuery};
use palpate_tactile::Signals;
use palpate_tactile::trial::{SimulatedTrial, TrialHeader, TrialId, TrialSource};
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Of a hundred trials, so many are recorded, and so many imported; the others are simulated.
const RECORDED: u32 = 15;
const IMPORTED: u32 = 5;
/// The newest simulated trials have frames, so that their sparklines can be made; all would be gigabytes.
const WITH_FRAMES: u32 = 600;
/// Rows in sight of a large window.
const PAGE: usize = 30;
/// Trials of a bulk edit.
const BULK: usize = 1000;
/// Longest wait for a view.
const PATIENCE: Duration = Duration::from_secs(120);

/// Row of the table.
#[derive(Serialize)]
pub(super) struct Waited {
    what: &'static str,
    p50_ms: f64,
    p95_ms: f64,
}

/// The service and the calls of its `wake`.
struct Bench {
    library: LibraryWorker,
    woken: Receiver<()>,
}

impl Bench {
    fn start(path: &Path) -> Result<Self, Failure> {
        let (calls, woken) = channel();
        let wake = Arc::new(move || {
            // Calls after the end of the bench are for nobody.
            let _heard = calls.send(());
        });
        Ok(Self { library: LibraryWorker::start(path.to_owned(), wake)?, woken })
    }

    /// Time from a command to a view that shows what was wanted (ms).
    fn wait(&self, command: LibraryCommand, wanted: impl Fn(&LibraryView) -> bool) -> Result<f64, Failure> {
        let asked = Instant::now();
        self.library.send(command);
        self.until(asked, wanted)
    }

    fn until(&self, asked: Instant, wanted: impl Fn(&LibraryView) -> bool) -> Result<f64, Failure> {
        while !(self.library.is_settled() && self.library.view().is_some_and(|view| wanted(&view))) {
            self.woken.recv_timeout(PATIENCE)?;
        }
        Ok(1e3 * asked.elapsed().as_secs_f64())
    }

    fn find(&self, query: TrialQuery) -> Result<f64, Failure> {
        let wanted = query.clone();
        self.wait(LibraryCommand::Find(query), move |view| view.query == wanted)
    }
}

pub(super) fn measure(trials: u32, runs: usize) -> Result<Costs<Waited>, Failure> {
    let folder = TemporaryFolder::new()?;
    let (rows, bytes) = wait_in(&folder.path().join("library.sqlite"), trials, runs)?;
    let remarks = vec![format!("{trials} trials; {runs} runs each; {}", memory(bytes, trials))];
    Ok(Costs { rows, columns: COLUMNS, remarks })
}

const COLUMNS: &[Column<Waited>] = &[
    ("from a command to its view", |row| row.what.to_owned()),
    ("p50 ms", |row| format!("{:.1}", row.p50_ms)),
    ("p95 ms", |row| format!("{:.1}", row.p95_ms)),
];

/// Memory of the process per trial, where the system reports it.
fn memory(bytes: Option<u64>, trials: u32) -> String {
    bytes.map_or_else(
        || "memory unknown on this system".to_owned(),
        |bytes| format!("{} bytes of memory per trial", bytes / u64::from(trials)),
    )
}

/// Resident memory of this process (bytes), on Linux.
fn resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    Some(1024 * line.trim().trim_end_matches("kB").trim().parse::<u64>().ok()?)
}

fn wait_in(path: &Path, trials: u32, runs: usize) -> Result<(Vec<Waited>, Option<u64>), Failure> {
    let filled = Instant::now();
    fill(path, trials)?;
    note(&format!("{trials} trials stored in {:.0} s", filled.elapsed().as_secs_f64()));
    let everything = TrialQuery { shown: Shown::All, ..TrialQuery::default() };
    let before = resident_bytes();
    let bench = Bench::start(path)?;
    let asked = Instant::now();
    let first = bench.find(everything.clone())?;
    let whole = bench.until(asked, |view| view.complete)?;
    let memory = before.zip(resident_bytes()).map(|(before, after)| after.saturating_sub(before));
    let mut rows = vec![row("open, first rows", vec![first]), row("open, all rows", vec![whole])];
    let of = |number: &dyn Fn(usize) -> Result<f64, Failure>| (0..runs).map(number).collect::<Result<Vec<_>, _>>();

    let found = |count: usize| move |view: &LibraryView| view.sparklines.len() >= count;
    bench.find(TrialQuery { source: Some(TrialSource::Simulated), ..everything.clone() })?;
    rows.push(row(
        "scroll: a page at a random place",
        of(&|run| {
            let asked = Instant::now();
            let view = bench.library.view().ok_or("no view")?;
            let from = scattered(run) % (view.found.len() - PAGE);
            let shown: Vec<String> = view.found[from..from + PAGE].iter().map(|trial| shown_text(trial)).collect();
            std::hint::black_box(shown);
            Ok(1e3 * asked.elapsed().as_secs_f64())
        })?,
    ));
    let mut drawn = 0;
    let mut pictures = Vec::new();
    for run in 0..runs.min(WITH_FRAMES as usize / PAGE) {
        let view = bench.library.view().ok_or("no view")?;
        let from = run * PAGE;
        let page: Vec<TrialId> = view.found[from..from + PAGE].iter().map(|trial| trial.row.id).collect();
        drawn += PAGE;
        pictures.push(bench.wait(LibraryCommand::Draw(page), found(drawn))?);
    }
    rows.push(row("sparklines of a page, once", pictures));
    let queries = filters();
    rows.push(row("filter", of(&|run| bench.find(queries[run % queries.len()].clone()))?));
    let words = ["lemon", "wet", "9", "99 sl", "tomato run", "pressure", "nothing like it", "e", "set 7", "slipped"];
    let search = |run: usize| TrialQuery {
        // Typed letter by letter: every query differs from the one before.
        search: format!("{}{}", words[run % words.len()], " ".repeat(run / words.len())),
        ..everything.clone()
    };
    rows.push(row("search", of(&|run| bench.find(search(run)))?));
    let sorted = |run: usize| {
        let columns = TrialColumn::ALL;
        let order =
            TrialOrder { column: columns[run % columns.len()], descending: (run / columns.len()).is_multiple_of(2) };
        TrialQuery { order, ..everything.clone() }
    };
    rows.push(row("sort", of(&|run| bench.find(sorted(run)))?));
    bench.find(TrialQuery::default())?;
    rows.push(row("tag 1000 trials", edits(&bench, runs.min(20))?));
    rows.push(row("another program's undo of that", undos(&bench, path, runs.min(20))?));
    Ok((rows, memory))
}

/// What the window writes of a trial.
fn shown_text(trial: &palpate_store::LibraryTrial) -> String {
    let row = &trial.row;
    format!("{} {} {} {} {}", row.id, trial.title, row.local, trial.quality().name(), row.tags.join(" "))
}

fn edits(bench: &Bench, runs: usize) -> Result<Vec<f64>, Failure> {
    (0..runs)
        .map(|run| {
            let view = bench.library.view().ok_or("no view")?;
            let bulk = BULK.min(view.found.len());
            let from = scattered(run) % (view.found.len() - bulk + 1);
            let ids: Vec<TrialId> = view.found[from..from + bulk].iter().map(|trial| trial.row.id).collect();
            let tag = format!("bulk{run}");
            let tagged = {
                let tag = tag.clone();
                move |view: &LibraryView| view.counts.tags.iter().any(|(name, count)| *name == tag && *count == bulk)
            };
            bench.wait(LibraryCommand::Edit(ids, TrialEdit::Tag(vec![tag])), tagged)
        })
        .collect()
}

fn undos(bench: &Bench, path: &Path, runs: usize) -> Result<Vec<f64>, Failure> {
    let other = Store::open(path)?;
    (0..runs)
        .rev()
        .map(|run| {
            let asked = Instant::now();
            other.journal().undo()?;
            let tag = format!("bulk{run}");
            bench.until(asked, |view| view.counts.tags.iter().all(|(name, _)| *name != tag))
        })
        .collect()
}

fn row(what: &'static str, mut times: Vec<f64>) -> Waited {
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((times.len() - 1) as f64 * share).round() as usize];
    Waited { what, p50_ms: at(0.5), p95_ms: at(0.95) }
}

/// A place that is elsewhere in each run.
fn scattered(run: usize) -> usize {
    run.wrapping_mul(2_654_435_761) >> 3
}

fn filters() -> Vec<TrialQuery> {
    let all = || TrialQuery { shown: Shown::All, ..TrialQuery::default() };
    let mut filters: Vec<TrialQuery> = TrialSource::ALL
        .map(|source| TrialQuery { source: Some(source), ..all() })
        .into_iter()
        .chain(PRESETS.map(|preset| TrialQuery { preset: Some(preset.name.to_owned()), ..all() }))
        .chain(TrialQuality::ALL.map(|quality| TrialQuery { quality: Some(quality), ..all() }))
        .chain(Flag::ALL.map(|flag| TrialQuery { flag: Some(flag), ..all() }))
        .collect();
    filters.extend(catalogue().iter().map(|b| TrialQuery { object: Some(b.title.clone()), ..all() }));
    filters.push(TrialQuery { since: Some(Day::Ago(0)), ..all() });
    filters.push(TrialQuery { tag: Some("wet".to_owned()), ..all() });
    filters.push(TrialQuery { unlabelled: true, ..all() });
    filters
}

/// Fills a store with trials of all sources, as a year of work might.
fn fill(path: &Path, trials: u32) -> Result<(), Failure> {
    let mut store = Store::open(path)?;
    let names: Vec<&str> = catalogue().iter().map(|b| b.name.as_str()).collect();
    let name = |k: u32| names[k as usize % names.len()];
    let (recorded, imported) = (trials / 100 * RECORDED, trials / 100 * IMPORTED);
    for k in 0..recorded {
        let object = if k % 5 == 0 { "" } else { name(k) };
        let about = BoardInfo { seconds: 5.9, ..BoardInfo::default() };
        let id = store.begin_board(&TrialHeader::new(object, Scene::default()), &about)?;
        let warnings: Vec<String> = (k % 9 == 0).then(|| "cut short".to_owned()).into_iter().collect();
        store.finish_board(id, &about, &warnings)?;
    }
    let signals = Signals {
        channels: ["pressure_left", "pressure_right"].map(str::to_owned).to_vec(),
        t_s: vec![0.0, 1.0],
        values: vec![0.0, 1.0, 2.0, 3.0],
    };
    let grasps: Vec<ImportedTrial> = (0..imported)
        .map(|k| ImportedTrial {
            name: k.to_string(),
            label: name(k).to_owned(),
            size: None,
            shape: None,
            session: None,
            signals: signals.clone(),
        })
        .collect();
    store.insert_imported("elsewhere", &grasps)?;
    let simulated = trials - recorded - imported;
    let mut template = grasped()?;
    let frames = std::mem::take(&mut template.data.frames);
    for from in (0..simulated).step_by(10_000) {
        let to = (from + 10_000).min(simulated);
        let made: Vec<SimulatedTrial> = (from..to)
            .map(|k| {
                let mut trial = template.clone();
                name(k).clone_into(&mut trial.header.object);
                name(k).clone_into(&mut trial.header.scene.object.source);
                trial.header.seed = u64::from(k);
                trial.header.collection = Some(format!("set {}", k / 8000));
                trial.header.scene.pose = PRESETS[k as usize / 500 % PRESETS.len()].poses();
                trial.data.quality.finite = k % 97 != 0;
                if k % 13 == 0 {
                    trial.header.warnings.push("the mass was guessed from the density".to_owned());
                }
                if k + WITH_FRAMES >= simulated {
                    trial.data.frames.clone_from(&frames);
                }
                trial
            })
            .collect();
        store.insert_collected(made.iter())?;
    }
    let every = |step: usize| (1..=TrialId::from(trials)).step_by(step).collect::<Vec<_>>();
    store.labels().edit(&every(40), &TrialEdit::Tag(vec!["wet".to_owned()]))?;
    store.labels().edit(&every(90), &TrialEdit::Note("slipped at the end of the run".to_owned()))?;
    store.labels().edit(&every(300), &TrialEdit::Discard)?;
    Ok(())
}

/// A grasp of the lemon.
fn grasped() -> Result<SimulatedTrial, Failure> {
    let mut scene = Scene::default();
    "lemon".clone_into(&mut scene.object.source);
    Ok(grasp(&scene, scene.load_object()?.as_ref(), 0))
}
