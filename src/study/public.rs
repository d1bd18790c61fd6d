//! Recordings of others: all methods on any data set that the import reads, as it is and re-zeroed, beside what can be told
//! without touch and beside published results.

use crate::frame::{
    Column, Experiment, Facets, GeneratedSection, LinkedFigure, PERCENT, StoredStudy, StudyCell, StudyCommand,
    StudyError, StudyReport, StudyTable, TableLine, TableRows, grouped, unique,
};
use crate::paper::{Pool, TestAnswers, judge};
use palpate_geometry::drawing::ReferenceLine;
use palpate_learn::comparison::in_table_order;
use palpate_learn::evaluation::interval_words;
use palpate_learn::{Dataset, Fitting, LeakCheck, LeakSource, LearnError, Method, SplitPlan};
use palpate_sim::fingerprint;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::sync::atomic::AtomicBool;

/// Key of the study, and its name.
pub const PUBLIC: &str = "public";
pub(crate) const TITLE: &str = "Recordings of others";

/// A data set of others, and what the study says of it.
#[derive(Clone, Debug)]
pub struct PublicData {
    /// The grasps as they were recorded.
    pub data: Dataset,
    /// Where they come from.
    pub about: String,
    pub published: PublishedResults,
    /// The command that repeats the study.
    pub command: StudyCommand,
    /// Random seed of fits and splits.
    pub seed: u64,
    /// Small networks, whose results are not to be quoted.
    pub quick: bool,
}

/// Published results on the same data, as the file of a user has them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedResults {
    pub published: Vec<PublishedResult>,
}

impl PublishedResults {
    /// Reads a file of them.
    pub fn parse(text: &str) -> Result<Self, String> {
        toml::from_str(text).map_err(|cause: toml::de::Error| cause.to_string())
    }
}

/// A published result.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedResult {
    pub method: String,
    /// The number with what it measures, or the words in its place.
    pub result: String,
    /// How it was measured.
    pub protocol: String,
    /// Where it is printed.
    pub source: String,
}

/// The study on a data set: cross-validation, or one session left out at a time where there are several.
pub fn public_study(of: PublicData) -> impl Experiment<Report = StudyReport> {
    let rezeroed = of.data.rezeroed();
    let split = if of.data.sessions().is_empty() { SplitPlan::CROSS_VALIDATION } else { SplitPlan::LeaveSessionOut };
    Public { rezeroed, split, of }
}

struct Public {
    of: PublicData,
    rezeroed: Dataset,
    split: SplitPlan,
}

/// How the readings are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    AsRecorded,
    Rezeroed,
}

impl Form {
    const ALL: [Self; 2] = [Self::AsRecorded, Self::Rezeroed];

    fn name(self) -> &'static str {
        match self {
            Self::AsRecorded => "as recorded",
            Self::Rezeroed => "re-zeroed",
        }
    }
}

#[derive(Clone, Copy)]
enum PublicCell {
    /// What can be told without touch.
    Leaks(Form),
    /// A method on all splits.
    Method(Form, &'static Method),
}

impl StudyCell for PublicCell {
    fn name(&self) -> String {
        match self {
            Self::Leaks(form) => format!("{}, without touch", form.name()),
            Self::Method(form, method) => format!("{}, {}", form.name(), method.key),
        }
    }

    fn method(&self) -> Option<&'static Method> {
        match self {
            Self::Leaks(_) => None,
            Self::Method(_, method) => Some(method),
        }
    }
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum PublicFound {
    Leaks(Vec<LeakCheck>),
    /// Answers on the test grasps of each split.
    Answers(Vec<TestAnswers>),
}

impl Public {
    fn data(&self, form: Form) -> &Dataset {
        match form {
            Form::AsRecorded => &self.of.data,
            Form::Rezeroed => &self.rezeroed,
        }
    }

    /// Fits and tests a method on every split; ends at the first that it cannot be fitted to.
    fn answers(&self, form: Form, method: &Method, stop: &AtomicBool) -> Result<Vec<TestAnswers>, StudyError> {
        let (data, mut all) = (self.data(form), Vec::new());
        for split in self.split.splits(data, self.of.seed, 1)? {
            let fitting = Fitting::new(self.of.seed, self.of.quick, stop);
            match method.train(&data.part(&split.all_training()), &fitting) {
                Ok(model) => all.push(TestAnswers::Answers(judge(&model, &data.part(&split.test)))),
                Err(LearnError::Stopped) => return Err(StudyError::Stopped),
                Err(cause @ LearnError::Refused(_)) => return Ok(vec![TestAnswers::NotFitted(cause.to_string())]),
            }
        }
        Ok(all)
    }

    /// A line on the grasps and one on how they are divided.
    fn lines(&self) -> Vec<String> {
        let data = &self.of.data;
        let (grasps, channels) = (data.examples.len(), data.channels.len());
        let objects = data.by_class().iter().filter(|members| !members.is_empty()).count();
        let sessions = data.sessions().into_iter().collect::<BTreeSet<u32>>().len();
        let split = self.split.described();
        let protocol = match sessions {
            0 => format!("no sessions: {split}, an upper bound of what a new session gives"),
            _ => format!("{sessions} sessions: {split}; {}", interval_words(data)),
        };
        vec![format!("{}: {grasps} grasps of {objects} objects, {channels} channels", self.of.about), protocol]
    }
}

impl Experiment for Public {
    type Cell = PublicCell;
    type Found = PublicFound;
    type Report = StudyReport;

    fn key(&self) -> &'static str {
        PUBLIC
    }

    fn header(&self) -> serde_json::Value {
        let contents: Vec<u8> =
            self.of.data.examples.iter().flat_map(|example| example.content.to_le_bytes()).collect();
        serde_json::json!({
            "grasps": format!("{:016x}", fingerprint([contents.as_slice()])),
            "seed": self.of.seed,
            "quick": self.of.quick,
        })
    }

    fn command(&self) -> StudyCommand {
        self.of.command.clone()
    }

    fn grid(&self) -> Vec<PublicCell> {
        let methods = in_table_order();
        let of = |form: Form| {
            let methods = methods.iter().map(move |method| PublicCell::Method(form, method));
            std::iter::once(PublicCell::Leaks(form)).chain(methods).collect::<Vec<_>>()
        };
        Form::ALL.into_iter().flat_map(of).collect()
    }

    fn measure(&self, cell: &PublicCell, stop: &AtomicBool) -> Result<PublicFound, StudyError> {
        match cell {
            PublicCell::Leaks(form) => Ok(PublicFound::Leaks(self.data(*form).leak_checks(self.of.seed).into())),
            PublicCell::Method(form, method) => self.answers(*form, method, stop).map(PublicFound::Answers),
        }
    }

    fn report(&self, found: Vec<(PublicCell, PublicFound)>) -> StudyReport {
        let (mut methods, mut leaks) = (Vec::new(), Vec::new());
        for (cell, found) in found {
            match (cell, found) {
                (PublicCell::Method(form, method), PublicFound::Answers(parts)) => {
                    methods.push(MethodRow { form, method, pool: Pool::of_parts(&parts), parts });
                }
                (PublicCell::Leaks(form), PublicFound::Leaks(checks)) => {
                    leaks.extend(checks.into_iter().map(|check| (form, check)));
                }
                _ => {}
            }
        }
        let (fitted, left_out): (Vec<_>, Vec<_>) = methods.into_iter().partition(|row| row.pool.len() > 0);
        let mut tables = vec![method_table(&fitted), leak_table(&leaks)];
        tables.extend(published_table(&self.of.published.published));
        tables.extend(left_out_table(&left_out));
        StudyReport::new(self.lines(), tables, Vec::new())
    }

    fn shown(report: &StudyReport) -> StudyReport {
        report.clone()
    }

    fn figures(report: &StudyReport) -> Vec<LinkedFigure> {
        let reference = |form: &str| {
            let (_, table) = report.table(LEAKS)?;
            let row = *table.rows_with(&[("readings", form), ("told by", BEFORE)]).first()?;
            let at = 100.0 * table.cell(row, "accuracy").value()?;
            Some(ReferenceLine { horizontal: false, at, text: format!("{at:.0} % are told before the touch") })
        };
        let facets = Facets {
            plot: &|line: TableLine<'_>| line.text("readings").to_owned(),
            series: &|line: TableLine<'_>| line.text("kind").to_owned(),
            reference: &reference,
            note: "Macro F1 after one grasp with 95 % intervals, by bootstrap over sessions where there are several, else over \
                   test grasps.",
            ..Facets::USUAL
        };
        facets.figure(report, PUBLIC).into_iter().collect()
    }
}

/// Names of the tables of leaks and of published results, and of the readings before the touch.
const LEAKS: &str = "public-leaks";
const PUBLISHED: &str = "public-published";
const BEFORE: &str = "readings before the touch";

struct MethodRow {
    form: Form,
    method: &'static Method,
    pool: Pool,
    parts: Vec<TestAnswers>,
}

fn method_table(rows: &[MethodRow]) -> StudyTable {
    TableRows::new(PUBLIC, "Methods on recorded grasps", rows).columns(&[
        Column("readings", "", &|row: &MethodRow| row.form.name().into()),
        Column("model", "", &|row| row.method.key.into()),
        Column("kind", "", &|row| row.method.kind.name().into()),
        Column("F1", PERCENT, &|row| row.pool.f1().into()),
        Column("accuracy", PERCENT, &|row| row.pool.accuracy().into()),
        Column("tested", "grasps", &|row| row.pool.len().into()),
    ])
}

/// Methods that cannot be trained on these grasps, by the reason.
fn left_out_table(rows: &[MethodRow]) -> Option<StudyTable> {
    // Networks of one kind each name themselves at the beginning of the same reason.
    let reason = |row: &MethodRow| {
        let reason = row.parts.iter().find_map(TestAnswers::reason).unwrap_or_default();
        reason.strip_prefix(row.method.title).map_or(reason, str::trim_start).to_owned()
    };
    let by_reason = grouped(rows.iter().map(|row| (reason(row), row.method.key)));
    let rows: Vec<(String, String)> =
        by_reason.into_iter().map(|(reason, keys)| (unique(keys).join(", "), reason)).collect();
    let table = TableRows::new("public-left-out", "Methods that cannot be trained on these grasps", &rows).columns(&[
        Column("models", "", &|(keys, _): &(String, String)| keys.as_str().into()),
        Column("reason", "", &|(_, reason)| reason.as_str().into()),
    ]);
    (!rows.is_empty()).then_some(table)
}

fn leak_table(rows: &[(Form, LeakCheck)]) -> StudyTable {
    TableRows::new(LEAKS, "What can be told without touch", rows).columns(&[
        Column("readings", "", &|(form, _): &(Form, LeakCheck)| form.name().into()),
        Column("told by", "", &|(_, check)| match check.source {
            LeakSource::Rest => BEFORE.into(),
            LeakSource::Length => "length of the trials".into(),
        }),
        Column("accuracy", PERCENT, &|(_, check)| check.accuracy.into()),
        Column("chance", PERCENT, &|(_, check)| Some(check.chance).into()),
        Column("verdict", "", &|(_, check)| {
            match (check.accuracy, check.leaks) {
                (None, _) => "not checked",
                (_, true) => "the object is told",
                (_, false) => "no sign of a leak",
            }
            .into()
        }),
        Column("by channels", "", &|(_, check)| check.channels.join(", ").into()),
    ])
}

fn published_table(rows: &[PublishedResult]) -> Option<StudyTable> {
    let table = TableRows::new(PUBLISHED, "Published results on the same data", rows).columns(&[
        Column("method", "", &|row: &PublishedResult| row.method.as_str().into()),
        Column("result", "", &|row| row.result.as_str().into()),
        Column("protocol", "", &|row| row.protocol.as_str().into()),
        Column("source", "", &|row| row.source.as_str().into()),
    ]);
    (!rows.is_empty()).then_some(table)
}

/// The study of the iCub's grasps in the manual, and its best number in the README.
pub(crate) fn sections() -> Result<Vec<GeneratedSection>, serde_json::Error> {
    let Some(stored) = StoredStudy::<StudyReport>::shipped(PUBLIC)? else { return Ok(Vec::new()) };
    let report = &stored.result;
    let text = format!("{}\n\n{}", report.data.join(". ") + ".", report.markdown(&stored.origin()));
    Ok(vec![
        GeneratedSection { document: "assets/help/recordings.md", name: "recordings of others", text },
        GeneratedSection { document: "README.md", name: "recordings in short", text: in_short(report) },
    ])
}

fn in_short(report: &StudyReport) -> String {
    let (Some((_, methods)), Some((_, leaks))) = (report.table(PUBLIC), report.table(LEAKS)) else {
        return String::new();
    };
    let form = ("readings", Form::Rezeroed.name());
    let f1 = |row: &usize| methods.cell(*row, "F1").value().unwrap_or(0.0);
    let best = methods.rows_with(&[form]).into_iter().max_by(|a, b| f1(a).total_cmp(&f1(b)));
    let before = leaks.rows_with(&[form, ("told by", BEFORE)]).first().copied();
    let (Some(best), Some(before)) = (best, before) else { return String::new() };
    let shown = |table: &StudyTable, row: usize, column: &str| table.cell(row, column).shown(PERCENT);
    format!(
        "On real grasps of others, by the iCub hand ({}), `{}` has the highest F1: {} %, of re-zeroed readings. This is an \
         upper bound: {} % can be told before anything is touched (chance {} %), and the set has no sessions (`palpate help \
         recordings`).",
        report.data.first().map_or("", String::as_str),
        methods.text(best, "model"),
        shown(methods, best, "F1"),
        shown(leaks, before, "accuracy"),
        shown(leaks, before, "chance"),
    )
}
