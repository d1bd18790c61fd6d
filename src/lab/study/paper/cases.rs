//! Studies whose units are cases of one kind.

use super::report::{LinkedFigure, StudyReport};
use super::{PaperStudy, StudyBench, StudyCard, StudyError, StudyPlan, StudyUnit, UnitResult};
use palpate_learn::Method;
use std::collections::BTreeMap;

/// A unit of work by its settings.
pub(super) trait StudyCase: Sized {
    /// All cases of a plan. Cases of the same data set follow each other.
    fn all(plan: &StudyPlan) -> Vec<Self>;

    /// Name of its unit.
    fn name(&self) -> String;

    /// Method that is fitted.
    fn method(&self) -> &'static Method;
}

/// A [`PaperStudy`] whose units are cases.
pub(super) trait CaseStudy: Sync {
    /// A unit of work.
    type Case: StudyCase;

    /// Name and purpose.
    const CARD: StudyCard;

    /// Computes a case; none where it was cancelled.
    fn measure(&self, case: Self::Case, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError>;

    /// Tables and findings from the results of all units.
    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError>;

    /// Figures, drawn from the tables.
    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure>;
}

impl<S: CaseStudy> PaperStudy for S {
    fn card(&self) -> StudyCard {
        S::CARD
    }

    fn units(&self, plan: &StudyPlan) -> Vec<StudyUnit> {
        let unit = |case: &S::Case| StudyUnit { name: case.name(), method: Some(case.method()) };
        S::Case::all(plan).iter().map(unit).collect()
    }

    fn measure(&self, unit: &str, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
        let case = S::Case::all(bench.plan()).into_iter().find(|case| case.name() == unit);
        CaseStudy::measure(self, case.ok_or_else(|| StudyError::Unknown(format!("unit {unit}")))?, bench)
    }

    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError> {
        CaseStudy::report(self, plan, units)
    }

    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure> {
        CaseStudy::figures(self, report)
    }
}
