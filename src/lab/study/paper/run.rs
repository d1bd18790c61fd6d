//! Running a study from its units to its report.

use super::bench::{StudyBench, StudyError, StudyProgress, StudyStep};
use super::report::StudyReport;
use super::{PaperStudy, StudyPlan, StudyUnit, UnitResult};
use crate::study::effects::Measuring;
use crate::study::result_file::ResultFile;
use crate::study::stored_study::StoredStudy;
use std::collections::BTreeMap;
use std::path::Path;

/// Fingerprint of a plan and of all methods that a study fits with it: results with another one are out of date.
pub fn study_fingerprint(study: &dyn PaperStudy, plan: &StudyPlan) -> String {
    let units = study.units(plan).iter().map(StudyUnit::stored_name).collect::<Vec<_>>().join("\n");
    format!("{:016x}", palpate_sim::fingerprint([plan.header().to_string().as_bytes(), units.as_bytes()]))
}

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
    let units: Vec<(String, String)> =
        study.units(plan).into_iter().map(|unit| (unit.stored_name(), unit.name)).collect();
    let names: BTreeMap<&str, &str> = units.iter().map(|(stored, name)| (stored.as_str(), name.as_str())).collect();
    file.retain(|stored| names.contains_key(stored));
    if !file.complete(&units, &how, |unit: &String| study.measure(unit, bench))? {
        return Ok(None);
    }
    let finished = file.units().iter().filter_map(|(stored, result)| {
        let name = names.get(stored.as_str())?;
        Some(((*name).to_owned(), result.clone()))
    });
    let report = study.report(plan, &finished.collect())?;
    let report = StudyReport { fingerprint: study_fingerprint(study, plan), ..report };
    let command = format!("palpate study {key}{}", plan.options());
    Ok(Some(StoredStudy::new(&command, file.cpu_hours(), report)))
}
