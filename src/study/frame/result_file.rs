//! Results of long studies, written as units of work finish: a study that was stopped or killed goes on where it
//! stopped.
//!
//! The file is JSON, a line for what is computed and one for each finished unit. A line that a crash cut off is left out
//! and computed again. Results that another plan or another physics computed are refused, never mixed.

use palpate_sim::PHYSICS_VERSION;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Step of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StudyStep {
    /// Simulates grasps that the store lacks.
    Collecting,
    /// Computes units.
    Measuring,
}

/// Progress of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StudyProgress {
    pub step: StudyStep,
    /// Grasps, units or effects done.
    pub done: usize,
    /// All of them.
    pub of: usize,
}

/// Threads, stop flag and progress of a measurement.
#[derive(Clone, Copy)]
pub struct Measuring<'a> {
    /// Number of threads. The results do not depend on it.
    pub threads: usize,
    /// Flag that stops it.
    pub cancelled: &'a AtomicBool,
    /// Receives progress.
    pub progress: &'a (dyn Fn(StudyProgress) + Sync),
}

impl Measuring<'_> {
    /// Reports measured units.
    pub(crate) fn measured(&self, done: usize, of: usize) {
        (self.progress)(StudyProgress { step: StudyStep::Measuring, done, of });
    }
}

/// Finished units of a study by name, in memory and, where it has one, in a file.
#[derive(Debug)]
pub struct ResultFile<U> {
    file: Option<(PathBuf, File)>,
    units: BTreeMap<String, U>,
    /// CPU time of each unit (s).
    cpu_s: BTreeMap<String, f64>,
}

/// What is computed; a file with another first line is refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Header {
    study: String,
    /// Version of the program, and a fingerprint of its physics.
    program: String,
    plan: serde_json::Value,
}

/// A finished unit: its line in the file.
#[derive(Serialize, Deserialize)]
struct Line<U> {
    unit: String,
    /// CPU time that it took (s).
    cpu_s: f64,
    result: U,
}

/// Fingerprints of the numbers of trials that units name, by the trials. Numbers differ between stores.
pub type TrialNumbers = BTreeMap<String, String>;

/// Last line of the file of a part.
#[derive(Serialize, Deserialize)]
struct EndOfPart {
    trials: TrialNumbers,
}

/// What a merge needs to know of a unit.
#[derive(Deserialize)]
struct UnitName {
    unit: String,
}

/// Joins files of finished units, parts of one study: the header, then each unit once, in the order of their names. Returns the
/// text and the number of units.
pub fn merged_units(files: &[PathBuf]) -> Result<(String, usize), ResultFileError> {
    let (mut first, mut units, mut numbers) = (None, BTreeMap::new(), TrialNumbers::new());
    for path in files {
        let failed = |cause| ResultFileError::File { attempt: "read", path: path.clone(), cause };
        let text = std::fs::read_to_string(path).map_err(failed)?;
        let (header, lines) = text.split_once('\n').unwrap_or_default();
        let own = serde_json::from_str::<Header>(header).map_err(|cause| failed(cause.into()))?;
        let (known, _) = first.get_or_insert_with(|| (own.clone(), header.to_owned()));
        if let Some(difference) = known.difference(&own) {
            return Err(ResultFileError::Other { path: path.clone(), difference });
        }
        for line in lines.lines() {
            if let Ok(UnitName { unit }) = serde_json::from_str(line) {
                units.entry(unit).or_insert_with(|| line.to_owned());
            } else if let Ok(EndOfPart { trials }) = serde_json::from_str(line) {
                for (trials, own) in trials {
                    if numbers.entry(trials.clone()).or_insert_with(|| own.clone()) != &own {
                        return Err(ResultFileError::OtherTrials { path: path.clone(), trials });
                    }
                }
            }
        }
    }
    let header = first.map(|(_, header)| header);
    let lines = header.iter().chain(units.values()).map(|line| format!("{line}\n"));
    Ok((lines.collect(), units.len()))
}

/// Error of a result file.
#[derive(Debug, thiserror::Error)]
pub enum ResultFileError {
    #[error("cannot {attempt} the results in \"{path}\": {cause}", path = path.display())]
    File {
        /// What was attempted.
        attempt: &'static str,
        /// The file.
        path: PathBuf,
        cause: io::Error,
    },
    #[error(
        "\"{path}\" holds results of {difference}, which cannot be continued: delete it or choose another --out",
        path = path.display()
    )]
    Other {
        /// The file.
        path: PathBuf,
        /// What differs.
        difference: String,
    },
    #[error(
        "\"{path}\" numbers its trials ({trials}) otherwise than the parts before it: measure all parts on copies of one store \
         that holds the grasps, or each on an empty store",
        path = path.display()
    )]
    OtherTrials {
        /// The file.
        path: PathBuf,
        trials: String,
    },
    #[error("a result cannot be written as JSON: {cause}")]
    Unwritable { cause: serde_json::Error },
}

impl<U: Serialize + DeserializeOwned> ResultFile<U> {
    /// Results in memory only, for measurements that take seconds.
    pub fn in_memory() -> Self {
        Self { file: None, units: BTreeMap::new(), cpu_s: BTreeMap::new() }
    }

    /// Opens the file of a study, or starts it. `plan` is everything else that its results depend on.
    pub fn open(path: &Path, study: &str, plan: &impl Serialize) -> Result<Self, ResultFileError> {
        let plan = serde_json::to_value(plan).map_err(|cause| ResultFileError::Unwritable { cause })?;
        let header = Header { study: study.to_owned(), program: program(), plan };
        let failed = |attempt| move |cause| ResultFileError::File { attempt, path: path.to_owned(), cause };
        if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(failed("create a folder for"))?;
        }
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => String::new(),
            Err(cause) => return Err(failed("read")(cause)),
        };
        // What a crash left of a line is no result.
        let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
        let mut results = Self::in_memory();
        let mut lines = whole.lines();
        if let Some(first) = lines.next() {
            let found = serde_json::from_str::<Header>(first);
            let difference =
                found.map_or_else(|_| Some("another program".to_owned()), |found| header.difference(&found));
            if let Some(difference) = difference {
                return Err(ResultFileError::Other { path: path.to_owned(), difference });
            }
            // A damaged line is computed again.
            for line in lines.filter_map(|line| serde_json::from_str::<Line<U>>(line).ok()) {
                results.keep(line);
            }
        }
        let mut file = OpenOptions::new().create(true).append(true).open(path).map_err(failed("open"))?;
        if whole.len() < text.len() {
            file.set_len(whole.len() as u64).map_err(failed("mend"))?;
        }
        if whole.is_empty() {
            let line = serde_json::to_string(&header).map_err(|cause| ResultFileError::Unwritable { cause })?;
            writeln!(file, "{line}").map_err(failed("write"))?;
        }
        results.file = Some((path.to_owned(), file));
        Ok(results)
    }

    fn keep(&mut self, line: Line<U>) {
        self.cpu_s.insert(line.unit.clone(), line.cpu_s);
        self.units.insert(line.unit, line.result);
    }

    /// Adds a finished unit, which took `cpu_s` seconds of CPU time, and writes it.
    pub fn add(&mut self, unit: &str, result: U, cpu_s: f64) -> Result<(), ResultFileError> {
        let line = Line { unit: unit.to_owned(), cpu_s, result };
        self.append(&line)?;
        self.keep(line);
        Ok(())
    }

    /// Ends the file of a part with the numbers of its trials.
    pub fn end_part(&mut self, trials: TrialNumbers) -> Result<(), ResultFileError> {
        self.append(&EndOfPart { trials })
    }

    fn append(&mut self, line: &impl Serialize) -> Result<(), ResultFileError> {
        let Some((path, file)) = &mut self.file else { return Ok(()) };
        let text = serde_json::to_string(line).map_err(|cause| ResultFileError::Unwritable { cause })? + "\n";
        let written = file.write_all(text.as_bytes()).and_then(|()| file.flush());
        written.map_err(|cause| ResultFileError::File { attempt: "write", path: path.clone(), cause })
    }

    /// Result of a unit, where it is finished.
    pub fn get(&self, unit: &str) -> Option<&U> {
        self.units.get(unit)
    }

    /// Finished units by name.
    pub fn units(&self) -> &BTreeMap<String, U> {
        &self.units
    }

    /// Leaves out all other units, such as those of an earlier version of a recogniser; they stay in the file.
    pub fn retain(&mut self, is_wanted: impl Fn(&str) -> bool) {
        self.units.retain(|unit, _| is_wanted(unit));
        self.cpu_s.retain(|unit, _| is_wanted(unit));
    }

    /// CPU time of all finished units (h).
    pub fn cpu_hours(&self) -> f64 {
        self.cpu_s.values().sum::<f64>() / 3600.0
    }
}

impl<U: Serialize + DeserializeOwned + Send + Sync> ResultFile<U> {
    /// Computes the units that are missing, in parallel, each in one thread: `work` gets a unit and returns its result,
    /// `None` where it was cancelled. Returns true when all units are finished.
    pub fn complete<W: Sync, E: From<ResultFileError> + Send>(
        &mut self,
        units: &[(String, W)],
        how: &Measuring<'_>,
        work: impl Fn(&W) -> Result<Option<U>, E> + Sync,
    ) -> Result<bool, E> {
        let missing: Vec<&(String, W)> = units.iter().filter(|(name, _)| self.get(name).is_none()).collect();
        let done = AtomicUsize::new(units.len() - missing.len());
        how.measured(done.load(Ordering::Relaxed), units.len());
        let (next, finished, failure) = (AtomicUsize::new(0), AtomicUsize::new(0), Mutex::new(None));
        let file = Mutex::new(self);
        let one = |name: &str, unit: &W| -> Result<(), E> {
            let start = cpu_time::ThreadTime::now();
            let Some(result) = work(unit)? else { return Ok(()) };
            let cpu_s = start.elapsed().as_secs_f64();
            // A poisoned lock: another thread panicked, and so does the scope.
            if let Ok(mut file) = file.lock() {
                file.add(name, result, cpu_s)?;
                finished.fetch_add(1, Ordering::Relaxed);
                how.measured(done.fetch_add(1, Ordering::Relaxed) + 1, units.len());
            }
            Ok(())
        };
        let all = || {
            while let Some((name, unit)) = missing.get(next.fetch_add(1, Ordering::Relaxed))
                && !how.cancelled.load(Ordering::Relaxed)
            {
                if let (Err(cause), Ok(mut failure)) = (one(name, unit), failure.lock()) {
                    failure.get_or_insert(cause);
                    next.store(missing.len(), Ordering::Relaxed);
                }
            }
        };
        // What a unit does in parallel stays in its thread, whose CPU time is the unit's.
        let alone = || rayon::ThreadPoolBuilder::new().num_threads(1).build();
        std::thread::scope(|scope| {
            for _ in 0..how.threads.clamp(1, missing.len().max(1)) {
                scope.spawn(|| match alone() {
                    Ok(pool) => pool.install(all),
                    Err(_none) => all(),
                });
            }
        });
        match failure.into_inner() {
            Ok(Some(cause)) => Err(cause),
            _ => Ok(finished.into_inner() == missing.len()),
        }
    }
}

impl Header {
    /// What differs from this in another header.
    fn difference(&self, other: &Self) -> Option<String> {
        if self.study != other.study {
            Some(format!("the study {}", other.study))
        } else if self.program != other.program {
            Some(format!("another version ({}, this is {})", other.program, self.program))
        } else if self.plan != other.plan {
            Some("other settings".to_owned())
        } else {
            None
        }
    }
}

/// Version of the program and of its physics: equal scenes give equal frames in builds with the same version of the physics.
pub fn program() -> String {
    format!("{}, physics {PHYSICS_VERSION}", env!("CARGO_PKG_VERSION"))
}

#[cfg(test)]
mod tests {
    use super::*;

    type TestResult = Result<(), Box<dyn std::error::Error>>;

    fn squares(file: &mut ResultFile<u64>, most: u64, stop_at: Option<u64>) -> Result<(bool, usize), ResultFileError> {
        let units: Vec<(String, u64)> = (0..most).map(|n| (format!("unit {n}"), n)).collect();
        let (cancelled, computed) = (AtomicBool::new(false), AtomicUsize::new(0));
        let how = Measuring { threads: 1, cancelled: &cancelled, progress: &|own| assert!(own.done <= own.of) };
        let finished = file.complete(&units, &how, |n| {
            if stop_at == Some(*n) {
                cancelled.store(true, Ordering::Relaxed);
                return Ok::<_, ResultFileError>(None);
            }
            computed.fetch_add(1, Ordering::Relaxed);
            Ok(Some(n * n))
        })?;
        Ok((finished, computed.into_inner()))
    }

    #[test]
    fn a_study_goes_on_where_it_stopped_or_crashed() -> TestResult {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("new/squares.jsonl");
        let mut file = ResultFile::open(&path, "squares", &5)?;
        assert_eq!(squares(&mut file, 5, Some(3))?, (false, 3));
        drop(file);
        // A crash in the middle of a line.
        let mut text = std::fs::read_to_string(&path)?;
        text.push_str("{\"unit\":\"unit 3\",\"cpu_");
        std::fs::write(&path, &text)?;
        let mut file = ResultFile::open(&path, "squares", &5)?;
        assert_eq!((file.units().len(), file.get("unit 2"), file.get("unit 3")), (3, Some(&4), None));
        assert_eq!(squares(&mut file, 5, None)?, (true, 2));
        let mut file = ResultFile::open(&path, "squares", &5)?;
        assert_eq!(squares(&mut file, 5, None)?, (true, 0));
        assert_eq!(file.get("unit 4"), Some(&16));
        file.add("later", 1, 7200.0)?;
        assert!(ResultFile::<u64>::open(&path, "squares", &5)?.cpu_hours() > 2.0);
        file.retain(|unit| unit != "later" && unit != "unit 4");
        assert!(file.cpu_hours() < 1.0 && file.units().len() == 4);
        assert_eq!(squares(&mut file, 5, None)?, (true, 1));
        Ok(())
    }

    #[test]
    fn results_of_something_else_are_refused() -> TestResult {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("squares.jsonl");
        ResultFile::<u64>::open(&path, "squares", &5)?;
        let refused = |study: &str, plan: u32| {
            ResultFile::<u64>::open(&path, study, &plan).map(|_| ()).expect_err("refused").to_string()
        };
        assert!(refused("cubes", 5).contains("the study squares"));
        assert!(refused("squares", 6).contains("other settings, which cannot be continued: delete it"));
        let text = std::fs::read_to_string(&path)?.replace("physics ", "physics x");
        std::fs::write(&path, text)?;
        assert!(refused("squares", 5).contains("another version"), "{}", refused("squares", 5));
        std::fs::write(&path, "name,value\n")?;
        assert!(refused("squares", 5).contains("another program"));
        Ok(())
    }
}
