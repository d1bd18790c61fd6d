//! Trials whose label differs from the model's prediction: either the label is wrong, or the model has something to
//! learn. The surest predictions come first, because wrong labels hide there (Northcutt, Jiang and Chuang, Confident
//! learning, 2021).

use palpate_store::labels::LabelledTrial;
use palpate_tactile::trial::TrialId;
use serde::Serialize;

/// A trial to look at again.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Disagreement {
    /// The trial.
    pub id: TrialId,
    /// Its label.
    pub label: String,
    /// Class predicted by the model.
    pub guess: String,
    /// Its probability.
    pub p: f64,
    /// Its probability of the label.
    pub label_p: f64,
}

/// Trials whose label differs from the prediction, most certain first, without reviewed ones and labels unknown to the
/// model.
pub fn disagreements(rows: &[LabelledTrial]) -> Vec<Disagreement> {
    let differs = |row: &LabelledTrial| {
        let (label, guess) = (row.object.as_ref()?, row.guess.as_ref()?);
        let differs = row.counts() && !row.reviewed && guess.class != *label;
        let label_p = guess.label_p.filter(|_| differs)?;
        Some(Disagreement { id: row.id, label: label.clone(), guess: guess.class.clone(), p: guess.p, label_p })
    };
    let mut found: Vec<Disagreement> = rows.iter().filter_map(differs).collect();
    found.sort_by(|a, b| b.p.total_cmp(&a.p).then(a.id.cmp(&b.id)));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_store::labels::GuessTop;

    fn row(id: TrialId, label: &str, class: &str, p: f64) -> LabelledTrial {
        let guess = GuessTop { model: "m".to_owned(), class: class.to_owned(), p, label_p: Some(0.1) };
        LabelledTrial { id, object: Some(label.to_owned()), complete: true, guess: Some(guess), ..Default::default() }
    }

    #[test]
    fn the_surest_disagreement_comes_first_and_what_is_settled_is_left_out() {
        let mut rows = vec![
            row(1, "lemon", "ball", 0.6),
            row(2, "lemon", "lemon", 0.9),
            row(3, "cube", "jenga", 0.95),
            row(4, "cube", "jenga", 0.6),
        ];
        rows.push(LabelledTrial { reviewed: true, ..row(5, "cube", "ball", 0.99) });
        rows.push(LabelledTrial { discarded: true, ..row(6, "cube", "ball", 0.99) });
        rows.push(LabelledTrial { object: None, ..row(7, "", "ball", 0.99) });
        rows.push(LabelledTrial { guess: None, ..row(8, "cube", "", 0.0) });
        let mut unknown = row(9, "mug", "ball", 0.99);
        unknown.guess.iter_mut().for_each(|guess| guess.label_p = None);
        rows.push(unknown);
        let ids: Vec<TrialId> = disagreements(&rows).iter().map(|found| found.id).collect();
        assert_eq!(ids, [3, 1, 4]);
        rows[2].reviewed = true;
        assert_eq!(disagreements(&rows).first().map(|found| found.id), Some(1));
    }
}
