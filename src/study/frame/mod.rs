//! The frame that all studies stand on: cells that are computed in parallel, kept and resumed; rows with columns; figures by
//! facets; claims; files.

mod claims;
mod drawing;
mod experiment;
mod folder;
mod groups;
mod listed;
mod report;
mod result_file;
mod shipped;
mod stored_study;

pub(super) use claims::{ALL_GAIN, Claim, Gains, Rule, negated};
pub(super) use drawing::{
    Along, F1_PERCENT, Facets, LinkedPlots, TableLine, confusion_figure, dots, lines, named_rows, plots_of, series_of,
};
pub use experiment::{Experiment, StudyCell, StudyError, StudyOutcome, run_experiment};
pub use folder::StudyFolder;
pub(super) use groups::{grouped, unique};
pub use listed::{Draw, ListedStudy, ShownStudy, StudyCard, StudySize};
pub(super) use listed::{OWN_METHODS, OWN_PHYSICS, PlainStudy, finish};
pub use report::{
    Agreement, Cell, ClaimNumber, FigureLink, FigureMark, Finding, IntervalStrip, LinkedFigure, PERCENT, POINTS,
    StudyColumn, StudyReport, StudyRow, StudyTable,
};
pub(super) use report::{Column, TableRows};
pub use result_file::{
    Measuring, ResultFile, ResultFileError, StudyProgress, StudyStep, TrialNumbers, merged_units, program,
};
pub(super) use stored_study::rounded;
pub use stored_study::{GeneratedSection, StoredStudy, StudyCommand, cpu_cost, markdown_table};
