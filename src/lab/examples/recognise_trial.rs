//! Recognises a stored trial by the shipped model:
//! `cargo run --release -p palpate-lab --example recognise_trial -- trials.sqlite 1`.

#![expect(clippy::print_stdout, reason = "an example that says what it did")]

use palpate_lab::datasets::{DatasetQuery, SensorView};
use palpate_learn::Shipped;
use palpate_store::Store;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args_os().skip(1);
    let path = PathBuf::from(arguments.next().ok_or("name a store")?);
    let id = arguments.next().and_then(|id| id.to_str()?.parse().ok()).ok_or("name a trial by its number")?;
    let (store, model) = (Store::open(&path)?, Shipped::PerfectSensors.model()?);
    // The channels that the model reads, through the sensors that it knows.
    let data = DatasetQuery::default().read_trial(&store, id, &SensorView::of_model(&model.card))?;
    model.check_channels(&data.channels)?;
    let verdict = model.recogniser.recognise(&data.examples[0].grasp, None);
    let mut likely: Vec<_> = model.card.labels.classes.iter().zip(verdict.pmf.probabilities()).collect();
    likely.sort_by(|a, b| b.1.total_cmp(a.1));
    for (class, probability) in likely.into_iter().take(3) {
        println!("{:5.1} %  {}", 100.0 * probability, class.name);
    }
    Ok(())
}
