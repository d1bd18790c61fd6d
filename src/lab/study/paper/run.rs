//! Running a study from its units to its report.

use super::bench::{StudyBench, StudyError, StudyProgress, StudyStep};
use super::report::StudyReport;
use super::{PaperStudy, UnitResult};
use crate::study::effects::Measuring;
use crate::study::result_file::ResultFile;
use crate::study::stored_study::StoredStudy;
use std::path::Path;

/// Runs a study on a bench; none where it was cancelled. A file keeps finished units: the same plan continues there.
pub fn run_study(
    study: &dyn PaperStudy,
    bench: &StudyBench<'_>,
    results: Option<&Path>,
) -> Result<Option<StoredStudy<StudyReport>>, StudyError> {
    let (plan, work, key) = (bench.plan(), bench.work(), study.card().key);
    let mut file = match results {
        Some(path) => ResultFile::<UnitResult>::open(path, key, &plan.header())?,
        None => ResultFile::in_memory(),
    };
    let progress = |done, of| (work.progress)(StudyProgress { step: StudyStep::Measuring, done, of });
    let how = Measuring { threads: work.threads, cancelled: work.cancelled, progress: &progress };
    let units: Vec<(String, String)> = study.units(plan).into_iter().map(|unit| (unit.clone(), unit)).collect();
    if !file.complete(&units, &how, |unit: &String| study.measure(unit, bench))? {
        return Ok(None);
    }
    let report = StudyReport { fingerprint: plan.fingerprint(), ..study.report(plan, file.units())? };
    let command = format!("palpate study {key}{}", plan.options());
    Ok(Some(StoredStudy::new(&command, file.cpu_hours(), report)))
}
