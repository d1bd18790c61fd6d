//! What nearly every study uses.

pub(super) use super::answers::{
    ModelAnswers, PARTS, Pool, SHOWN, TRAIN, TestAnswers, TestPart, confusion_table, judge, usual_grasps,
};
pub(super) use super::bench::StudyData;
pub(super) use super::plan::{DataWanted, StudyPlan, StudySize};
pub(super) use super::rows::{Factor, Fit, Kind, Row, by_model, compare, crossed, described, find, gains_over, pooled};
pub(super) use super::study::Study;
pub(super) use super::{OWN, StudyCard};
pub(super) use crate::frame::{
    ALL_GAIN, Agreement, Along, Cell, Claim, ClaimNumber, Column, F1_PERCENT, Facets, Finding, Gains, LinkedFigure,
    LinkedPlots, PERCENT, POINTS, Rule, StudyCell, StudyError, StudyReport, StudyTable, TableLine, TableRows,
    confusion_figure, dots, grouped, lines, named_gains, named_rows, negated, unique,
};
pub(super) use palpate_geometry::drawing::{DataPoint, DataSeries, LineStyle, Marker, Plot, PlotAxis, ReferenceLine};
pub(super) use palpate_learn::metrics::Interval;
pub(super) use palpate_learn::{
    Belief, Class, Dataset, Example, Labels, Method, MethodKind, Model, Pmf, Sequence, method,
};
pub(super) use palpate_tactile::model::SensorModel;
pub(super) use palpate_tactile::trial::TrialId;
pub(super) use serde::{Deserialize, Serialize};
pub(super) use std::sync::Arc;
