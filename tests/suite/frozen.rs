//! What users see and other programs rely on, frozen as texts: every `--json`, every help page, studies on a sample,
//! answers of the shipped models, stored frames, and the columns of every export.
//!
//! The texts stand in `tests/suite/frozen/`, most of them with the command lines that make them: a line more there
//! freezes one more. `UPDATE_SCREENSHOTS=1 cargo test --test suite` makes them anew; read what has changed, and give the
//! reason in the commit. What differs from run to run (times, dates, versions, paths) is masked by `#`.
//!
//! Numbers and digests repeat bit for bit on machines of one kind: x86-64 Linux with AVX2, FMA and AVX-512, in the
//! profile of the tests. On others, kernels for other processors round otherwise; there, only the keys of JSON are
//! compared, and texts without numbers.

use crate::calibration::{capture, parts};
use crate::program::{palpate, ran, run};
use palpate_lab::datasets::{DatasetQuery, SensorView};
use palpate_lab::grasping::{Advisor, RecognisedGrasp, Shard};
use palpate_learn::{Pmf, Shipped};
use palpate_sim::fingerprint;
use palpate_store::{Store, TrialRow, encode_frames};
use palpate_study::accuracy::{AccuracyExperiment, AccuracyPlan, SettingFamily};
use palpate_study::{Agreement, Cell, Measuring, StoredStudy, StudyReport, run_experiment};
use palpate_tactile::trial::{TrialId, TrialSource};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Keys of JSON whose values differ from run to run.
const UNREPEATABLE: &str = "at bytes check_cpu_ms cost cost_share cpu_hours cpu_ms cpu_ms_least cpu_ms_median cpu_ms_p95 cpu_s created deleted load_cpu_ms \
     local moved offsets p50_ms p95_ms program seconds step_us taken threads times_real_time train_cpu_s \
     trial_uid uid us_per_step";
/// Beginning of a command line in a frozen text.
const PROMPT: &str = "$ palpate ";
/// Stands for the repository in a command line.
const ROOT: &str = "REPOSITORY";
/// Longest list that stands whole.
const MOST: usize = 30;
/// Longest line of JSON that is not broken up (characters).
const LINE: usize = 150;

/// True on machines of the kind that the numbers were frozen on.
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
fn is_of_the_kind() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") && is_x86_feature_detected!("avx512f")
}

#[cfg(not(all(target_arch = "x86_64", target_os = "linux")))]
fn is_of_the_kind() -> bool {
    false
}

/// Keys of the JSON in a text.
fn keys(text: &str) -> BTreeSet<&str> {
    text.split("\":").filter_map(|before| Some(before.rsplit_once('"')?.1)).collect()
}

/// File of a frozen text.
fn frozen(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/suite/frozen/{name}.txt"))
}

/// Compares a text that is the same on all machines with the frozen one, or freezes it.
pub(crate) fn compare(name: &str, text: &str) {
    let path = frozen(name);
    if std::env::var_os("UPDATE_SCREENSHOTS").is_some() {
        return std::fs::write(path, text).unwrap();
    }
    let was = std::fs::read_to_string(&path).unwrap_or_default();
    if was == text {
        return;
    }
    let seen = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("screenshots/failed/{name}.txt"));
    std::fs::create_dir_all(seen.parent().unwrap()).unwrap();
    std::fs::write(&seen, text).unwrap();
    let differs = was.lines().zip(text.lines()).position(|(was, is)| was != is);
    let line = differs.unwrap_or_else(|| was.lines().count().min(text.lines().count()));
    let [was, is] = [&was, text].map(|text| text.lines().nth(line).unwrap_or("(end)"));
    panic!("{name}, line {}, was\n{was}\nand is\n{is}\nSee all: diff {} {}", line + 1, path.display(), seen.display());
}

/// Compares a text with numbers.
pub(crate) fn compare_numbers(name: &str, text: &str) {
    let was = std::fs::read_to_string(frozen(name)).unwrap_or_default();
    if is_of_the_kind() || keys(&was) != keys(text) {
        compare(name, text);
    }
}

/// Masks what differs from run to run.
fn masked(value: &mut Value) {
    match value {
        Value::Object(fields) => {
            if fields.get("check").is_some_and(|check| check == "modem-manager") {
                *value = "# of the machine".into();
                return;
            }
            for (key, value) in fields.iter_mut().filter(|(_, value)| !value.is_null()) {
                if UNREPEATABLE.split(' ').any(|own| own == key) { *value = "#".into() } else { masked(value) }
            }
        }
        Value::Array(values) => values.iter_mut().for_each(masked),
        Value::String(text) if text == env!("CARGO_PKG_VERSION") => *value = "#".into(),
        _ => {}
    }
}

fn digest(bytes: &[u8]) -> String {
    format!("{:016x}", fingerprint([bytes]))
}

/// JSON for reading: what fits into a line stands in one. Of long lists, the first elements stand, and a
/// digest of all.
fn shown(value: &Value, indent: usize, out: &mut String) {
    let (line, pad) = (value.to_string(), " ".repeat(indent + 2));
    match value {
        Value::Array(values) if values.len() > MOST || line.len() > LINE => {
            let stand = if values.len() > MOST { 3 } else { values.len() };
            let between = if values.iter().all(Value::is_number) { " ".to_owned() } else { format!("\n{pad}") };
            out.push('[');
            for value in &values[..stand] {
                out.push_str(&between);
                shown(value, indent + 2, out);
            }
            if stand < values.len() {
                write!(out, "{between}.. {} in all, digest: {}", values.len(), digest(line.as_bytes())).unwrap();
            }
            out.push_str(&between.replacen("  ", "", 1));
            out.push(']');
        }
        Value::Object(fields) if line.len() > LINE => {
            out.push('{');
            for (key, value) in fields {
                write!(out, "\n{pad}{key:?}: ").unwrap();
                shown(value, indent + 2, out);
            }
            write!(out, "\n{}}}", &pad[2..]).unwrap();
        }
        _ => out.push_str(&line),
    }
}

/// A result in JSON, with what differs from run to run masked.
pub(crate) fn pretty(mut value: Value) -> String {
    let mut text = String::new();
    masked(&mut value);
    shown(&value, 0, &mut text);
    text + "\n"
}

/// Runs the command lines of a frozen text in a folder, and shows what comes of them: JSON that is printed, the columns of
/// files that are written, digests of the frames of grasps.
fn played(at: &Path, name: &str) -> String {
    let (mut text, mut last) = (String::new(), 0);
    for line in std::fs::read_to_string(frozen(name)).unwrap().lines().filter(|line| line.starts_with(PROMPT)) {
        let arguments = line[PROMPT.len()..].replace(ROOT, env!("CARGO_MANIFEST_DIR"));
        let arguments: Vec<&str> = arguments.split(' ').collect();
        let ran = run(at, &arguments);
        writeln!(text, "\n{line}").unwrap();
        let is_json = ["--json", "--print-secrets", "--print-settings"].iter().any(|json| arguments.contains(json));
        assert!(is_json || ran.code == Some(0), "{line}: {ran:?}");
        if let Some(code) = ran.code.filter(|code| *code != 0) {
            writeln!(text, "exit code {code}").unwrap();
        }
        if is_json {
            for value in serde_json::Deserializer::from_str(&ran.out).into_iter() {
                text += &pretty(value.unwrap_or_else(|error| panic!("{line}: {error}: {ran:?}")));
            }
        }
        match arguments.iter().position(|argument| *argument == "--out") {
            Some(option) => text += &columns(at, arguments[option + 1]),
            None if !is_json && ["grasp", "collect"].contains(&arguments[0]) => text += &frames(at, &mut last),
            None => {}
        }
    }
    text.replace(at.to_str().unwrap(), "#")
}

fn play(at: &Path, name: &str) {
    compare_numbers(name, &played(at, name));
}

/// Digests of the frames of grasps that came into the store after the last one.
fn frames(at: &Path, last: &mut TrialId) -> String {
    let (store, mut text) = (Store::open(&at.join("trials.sqlite")).unwrap(), String::new());
    for row in store.list(false).unwrap() {
        let TrialRow { id, object, seed, source, .. } = &row;
        if *id > *last && *source == TrialSource::Simulated {
            let bytes = encode_frames(store.load(*id).unwrap().frames());
            writeln!(text, "trial {id}: {object}, seed {seed}, digest {}", digest(&bytes)).unwrap();
        }
        *last = (*last).max(*id);
    }
    text
}

/// Columns of a file, or of all files of a folder.
fn columns(at: &Path, name: &str) -> String {
    let path = at.join(name);
    if path.is_dir() {
        let names = std::fs::read_dir(path).unwrap().map(|file| file.unwrap().file_name().into_string().unwrap());
        return names.collect::<BTreeSet<_>>().iter().map(|file| columns(at, &format!("{name}/{file}"))).collect();
    }
    let own = match path.extension().and_then(|ending| ending.to_str()) {
        Some("csv") => {
            let contacts = name.replace(".csv", ".contacts.csv");
            let contacts = if at.join(&contacts).is_file() { columns(at, &contacts) } else { String::new() };
            format!("{}\n{contacts}", std::fs::read_to_string(&path).unwrap().lines().next().unwrap())
        }
        Some("json") => pretty(serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()),
        Some("safetensors") => return columns(at, &name.replace(".safetensors", ".json")),
        Some("mcap") => mcap(&std::fs::read(path).unwrap()),
        Some("npz") => npz(&std::fs::read(path).unwrap()),
        _ => String::new(),
    };
    format!("{name}: {}\n", own.trim_end())
}

/// Bytes that are read from the front, as MCAP has them.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn bytes(&mut self, count: usize) -> &'a [u8] {
        let (bytes, rest) = self.0.split_at(count);
        self.0 = rest;
        bytes
    }

    /// A whole number of so many bytes.
    fn number(&mut self, bytes: usize) -> usize {
        self.bytes(bytes).iter().rev().fold(0, |sum, byte| (sum << 8) | usize::from(*byte))
    }

    fn text(&mut self) -> String {
        let length = self.number(4);
        String::from_utf8_lossy(self.bytes(length)).into_owned()
    }
}

/// Schemas with their fields, topics, metadata and files of an MCAP file, from its summary.
fn mcap(bytes: &[u8]) -> String {
    let mut text = String::new();
    let begin = Fields(&bytes[bytes.len() - 28..]).number(8);
    let mut records = Fields(&bytes[begin..]);
    loop {
        let (code, length) = (records.number(1), records.number(8));
        let mut own = Fields(records.bytes(length));
        match code {
            2 => return text,
            3 => {
                let (id, name, kind) = (own.number(2), own.text(), own.text());
                writeln!(text, "schema {id} {name} ({kind})\n  {}", own.text().replace('\n', "\n  ")).unwrap();
            }
            4 => {
                let (id, schema, topic, kind) = (own.number(2), own.number(2), own.text(), own.text());
                writeln!(text, "channel {id} of schema {schema}: {topic} ({kind})").unwrap();
            }
            10 => {
                own.bytes(40);
                writeln!(text, "file {} ({})", own.text(), own.text()).unwrap();
            }
            13 => {
                let place = own.number(8);
                let mut record = Fields(&bytes[place + 9..][..own.number(8) - 9]);
                let (name, mut pairs) = (record.text(), Vec::new());
                record.number(4);
                while !record.0.is_empty() {
                    pairs.push(record.text());
                    record.text();
                }
                writeln!(text, "metadata {name}: {}", pairs.join(", ")).unwrap();
            }
            _ => {}
        }
    }
}

/// Names, types and shapes of the arrays of an NPZ archive.
fn npz(bytes: &[u8]) -> String {
    let mut text = String::new();
    for (at, _) in bytes.windows(4).enumerate().filter(|(_, own)| own == b"PK\x03\x04") {
        let mut own = Fields(&bytes[at + 26..]);
        let (name, extra) = (own.number(2), own.number(2));
        let name = String::from_utf8_lossy(own.bytes(name));
        own.bytes(extra + 8);
        let length = own.number(2);
        writeln!(text, "{name} {}", String::from_utf8_lossy(own.bytes(length)).trim_end()).unwrap();
    }
    text
}

/// Texts with JSON.
const JSON: [&str; 5] = ["json_simulated", "json_real", "json_learning", "json_bench", "studies_physics"];

/// Commands whose JSON is in none of them: the tests of `teach`, `promise`, `gap` and of the studies of the paper freeze theirs where they
/// run them; the others need a renderer, seconds of CPU time or a real clock.
const NOT_PLAYED: [&str; 7] = ["teach", "promise", "gap", "study ", "bench frame", "bench training", "emulate"];

#[test]
fn help_pages_are_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    let played = JSON.map(|name| std::fs::read_to_string(frozen(name)).unwrap()).concat();
    let (mut text, mut left) = (String::new(), vec![String::new()]);
    while let Some(command) = left.pop() {
        let mut program = palpate(&folder.path().join("trials.sqlite"));
        let output = program.args(command.split_whitespace()).arg("--help").env("COLUMNS", "100").output().unwrap();
        let page = ran(&output).out;
        writeln!(text, "\n$ palpate{command} --help\n{page}").unwrap();
        let below = page.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
        let names = below.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
        let names: Vec<&str> = names.filter_map(|line| line.split_whitespace().next()).collect();
        left.extend(names.iter().rev().map(|name| format!("{command} {name}")));
        let is_played = played.contains(&format!("$ palpate{command} "));
        let is_elsewhere = NOT_PLAYED.iter().any(|own| command[1.min(command.len())..].starts_with(own));
        assert!(is_played || is_elsewhere || !page.contains("  --json  "), "freeze palpate{command} --json");
    }
    compare("help", &text);
}

#[test]
fn json_of_simulated_grasps_is_as_it_was() {
    play(tempfile::tempdir().unwrap().path(), "json_simulated");
}

/// Bytes that the emulated gripper sends: an empty close, two grasps, one of them with faults, a rest, a hand that is moved.
fn captured(at: &Path) {
    let moves = ["angleL=40", "angleR=40", "loadL=2N", "loadR=2N"].map(|step| format!("rest=2.2; {step} hold=1; "));
    for (name, script, faults, seconds) in [
        ("close.bytes", "rest=0.5; close empty bar=0.6", "", 5.0),
        ("lemon.bytes", "rest=0.5; grasp lemon bar=0.8", "", 5.0),
        ("flawed.bytes", "rest=0.5; grasp ball bar=0.7", "saturation=3@1.5,loss=0.3@1/1", 5.0),
        ("rest.bytes", "rest=4", "", 4.0),
        ("hand.bytes", &(moves.concat() + "rest=3"), "crosstalk=0.05@0", 16.0),
    ] {
        capture(&parts(3, false), script, faults, seconds, &at.join(name));
    }
}

#[test]
fn json_of_the_real_gripper_is_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    captured(folder.path());
    let points = "angle_deg,counts\n0,1384\n30,1710\n60,1968\n90,2176\n";
    std::fs::write(folder.path().join("strip.csv"), points).unwrap();
    play(folder.path(), "json_real");
}

#[test]
fn json_of_learning_is_as_it_was() {
    play(tempfile::tempdir().unwrap().path(), "json_learning");
}

#[test]
fn json_of_benchmarks_is_as_it_was() {
    play(tempfile::tempdir().unwrap().path(), "json_bench");
}

#[test]
fn columns_of_exports_are_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    captured(folder.path());
    let mine = "trial,label,size,shape,t_s,grip\n1,mug,tiny,cubic,0,1\n1,mug,tiny,cubic,0.1,2\n";
    std::fs::write(folder.path().join("mine.csv"), mine).unwrap();
    compare("columns", &played(folder.path(), "columns"));
}

#[test]
fn frames_and_answers_are_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    play(folder.path(), "frames");
    compare_numbers("answers", &answers(&Store::open(&folder.path().join("trials.sqlite")).unwrap()));
}

/// Trials that the shipped models answer to.
const ASKED: [TrialId; 8] = [1, 7, 12, 23, 30, 35, 39, 45];

/// What each shipped model answers to stored grasps, with all that it reads: geometry, and grasps in known poses.
fn answers(store: &Store) -> String {
    let mut text = String::new();
    for shipped in Shipped::ALL {
        let (model, mut advisor) = (Arc::new(shipped.model().unwrap()), Advisor::default());
        for id in ASKED {
            let data = DatasetQuery::default().read_trial(store, id, &SensorView::of_model(&model.card)).unwrap();
            let grasp = &data.examples[0].grasp;
            let mut live = model.recogniser.live().unwrap();
            live.begin(model.card.prior().as_ref());
            let steps = grasp.t_s.iter().zip(grasp.values.chunks(data.channels.len()));
            let mut all: Vec<Pmf> = steps.filter_map(|(t, row)| Some(live.push(*t, row)?.pmf)).collect();
            all.extend(live.finish().map(|verdict| verdict.pmf));
            let alone = RecognisedGrasp::alone(Arc::clone(&model), grasp.as_ref().clone(), None);
            all.extend_from_slice(alone.belief.steps());
            let bytes: Vec<u8> = all.iter().flat_map(Pmf::probabilities).flat_map(|p| p.to_le_bytes()).collect();
            let (class, p) = alone.belief.now().unwrap().top();
            let (file, class) = (shipped.model_file(), &model.card.labels.classes[class].name);
            let advice = advisor.advice(&alone).unwrap().of_object();
            writeln!(text, "{file}, trial {id}: {class} {p}, {advice}, digest: {}", digest(&bytes)).unwrap();
        }
    }
    text
}

/// A study of the paper for reading, without times and numbers of trials.
pub(crate) fn study(stored: &StoredStudy<StudyReport>) -> String {
    let mut report = stored.clone();
    let mut text = String::new();
    for table in &mut report.result.tables {
        writeln!(text, "{} as CSV: {}", table.name, table.csv().lines().next().unwrap_or_default()).unwrap();
        for (at, column) in table.columns.iter().enumerate() {
            if ["CPU s", "µs", "ms"].contains(&column.unit.as_str()) {
                table.rows.iter_mut().for_each(|row| row.cells[at] = Cell::text("#"));
            }
        }
        // Numbers of trials depend on threads: how many there are stands.
        table.rows.iter_mut().for_each(|row| row.trials = vec![row.trials.len() as TrialId]);
    }
    for finding in report.result.findings.iter_mut().filter(|finding| finding.claim.ends_with("costs less")) {
        (finding.found, finding.verdict) = ("#".to_owned(), Agreement::NotMeasured);
        finding.measured.clear();
    }
    format!("\n## {}\n{text}{}", stored.command, pretty(serde_json::to_value(&report).unwrap()))
}

/// The accuracy study with a setting of each family but the dearest, and trained on the cheapest.
fn accuracy_plan() -> AccuracyPlan {
    let (mut plan, mut families) = (AccuracyPlan::quick(), BTreeSet::from([SettingFamily::Taxels]));
    plan.settings.retain(|setting| families.insert(setting.family) || setting.is_default());
    plan.objects = ["cube", "lemon"].map(str::to_owned).to_vec();
    plan.poses = 1;
    let recognition = &mut plan.recognition;
    (recognition.train_grasps, recognition.test_grasps) = (4, 4);
    recognition.settings.truncate(1);
    recognition.test = recognition.settings[0].clone();
    recognition.methods.truncate(2);
    plan
}

#[test]
fn studies_of_the_physics_are_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    play(folder.path(), "studies_physics");
    let study = AccuracyExperiment::new(accuracy_plan()).unwrap();
    let how = Measuring { threads: 2, cancelled: &AtomicBool::new(false), progress: &|_| () };
    let accuracy = run_experiment(&study, &how, None, Shard::WHOLE).unwrap().whole().unwrap().result;
    compare_numbers("studies_accuracy", &pretty(serde_json::to_value(&accuracy).unwrap()));
}
