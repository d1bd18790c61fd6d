//! A small grid search for the settings of a network: every point is scored by cross-validation on the training data
//! alone.

use crate::data::Dataset;
use crate::evaluation::answer;
use crate::fitting::{Fitting, LearnError};
use crate::methods::Method;
use crate::metrics::Confusion;
use crate::split::{SplitError, SplitPlan};
use serde::Serialize;
use std::sync::atomic::AtomicBool;

/// Settings and their score.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SearchRow {
    /// Changed settings.
    pub settings: serde_json::Map<String, serde_json::Value>,
    /// Macro F1 on the held-out folds of the training data.
    pub f1_macro: f64,
}

/// The grid: units, dropout and weight decay, the three settings with the largest influence in earlier experiments.
const GRID: [(&str, &[f64]); 3] = [("units", &[64.0, 128.0]), ("dropout", &[0.3, 0.5]), ("weight_decay", &[0.1, 0.4])];
/// Number of folds; each is held out once.
const FOLDS: usize = 2;

/// Error of a search.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SearchError {
    #[error(transparent)]
    Fit(#[from] LearnError),
    #[error(transparent)]
    Split(#[from] SplitError),
}

/// Scores all points of the grid, best first. Settings given by the caller stay fixed.
pub fn search(
    method: &'static Method,
    data: &Dataset,
    seed: u64,
    quick: bool,
    given: &serde_json::Map<String, serde_json::Value>,
    progress: &dyn Fn(usize, usize),
) -> Result<Vec<SearchRow>, SearchError> {
    if method.recipe.is_none() {
        let cause = "only networks have settings to search for".to_owned();
        return Err(LearnError::setting("search", cause).into());
    }
    let mut points = vec![given.clone()];
    for (name, values) in GRID.iter().filter(|(name, _)| !given.contains_key(*name)) {
        let with = |point: &serde_json::Map<String, serde_json::Value>, value: f64| {
            let mut point = point.clone();
            let whole = value.fract() == 0.0;
            let value = if whole { serde_json::json!(value as u64) } else { serde_json::json!(value) };
            point.insert((*name).to_owned(), value);
            point
        };
        points = points.iter().flat_map(|point| values.iter().map(move |v| with(point, *v))).collect();
    }
    let splits = SplitPlan::Folds { folds: FOLDS }.splits(data, seed ^ 0x5ea7c4, 1)?;
    let classes = data.labels.classes.len();
    let stop = AtomicBool::new(false);
    let mut rows = Vec::new();
    for (n, settings) in points.iter().enumerate() {
        let mut pairs = Vec::new();
        for (fold, split) in splits.iter().enumerate() {
            progress(n * FOLDS + fold, points.len() * FOLDS);
            let (train, left_out) = (data.part(&split.train), data.part(&split.test));
            let fitting = Fitting { settings: settings.clone(), ..Fitting::new(seed, quick, &stop) };
            let recogniser = (method.fit)(&train, &fitting)?;
            let answers = answer(recogniser.as_ref(), &left_out);
            pairs.extend(answers.truth.iter().zip(&answers.verdicts).map(|(t, v)| (*t, Some(v.pmf.top().0))));
        }
        let f1_macro = Confusion::from_pairs(classes, pairs).and_then(|c| c.macro_f1()).unwrap_or(0.0);
        rows.push(SearchRow { settings: settings.clone(), f1_macro });
    }
    rows.sort_by(|a, b| b.f1_macro.total_cmp(&a.f1_macro));
    Ok(rows)
}
