//! What nearly every study uses.

pub(super) use super::answers::{
    ModelAnswers, PARTS, Pool, SHOWN, TRAIN, TestAnswers, TestPart, confusion_table, judge, usual_grasps,
};
pub(super) use super::bench::StudyData;
pub(super) use super::plan::{DataWanted, STUDY_PRESET, StudyPlan};
pub(super) use super::rows::{
    Crossing, Factor, Fit, Kind, Row, by_model, compare, crossed, described, find, gains_over, pooled,
};
pub(super) use super::study::Study;
pub(super) use crate::frame::{
    ALL_GAIN, Agreement, Along, Cell, Claim, ClaimNumber, Column, F1_PERCENT, Facets, Finding, LinkedFigure,
    LinkedPlots, OWN_METHODS, PERCENT, POINTS, Rule, StudyCard, StudyCell, StudyError, StudyReport, StudySize,
    StudyTable, TableLine, TableRows, confusion_figure, dots, grouped, lines, named_rows, negated, unique,
};
pub(super) use palpate_geometry::drawing::{DataPoint, DataSeries, LineStyle, Marker, Plot, PlotAxis, ReferenceLine};
pub(super) use palpate_lab::datasets::SensorView;
pub(super) use palpate_learn::metrics::Interval;
pub(super) use palpate_learn::{
    Belief, Class, Dataset, Example, Labels, Method, MethodKind, Model, Pmf, Sequence, method,
};
pub(super) use palpate_tactile::model::SensorModel;
pub(super) use palpate_tactile::trial::TrialId;
pub(super) use serde::{Deserialize, Serialize};
pub(super) use std::sync::Arc;
