//! Numbers of a store that was made earlier: a simulated grasp and trials of the emulated board.

use super::*;
use palpate_store::Store;
use palpate_tactile::{SensorLayout, SignalDefinition};

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * b.abs()
}

#[test]
fn a_store_of_version_0_1_0_is_exported_with_the_same_numbers() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("trials.sqlite");
    std::fs::copy(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/suite/data/store.sqlite"), &path)?;
    let store = Store::open(&path)?;
    let out = folder.path().join("labelled");
    let exported = export_labelled(&store, &out)?;
    assert_eq!((exported.trials, exported.derived), (2, 2));
    assert_eq!(std::fs::read(out.join("raw/trial_4_lemon.bytes"))?.len(), 17_083);
    let raw = std::fs::read_to_string(out.join("raw/trial_4_lemon.csv"))?;
    let row = "1.1599999999999997,1.1610256049999998,84,,1687.8,1618.1,842.3,946.1,0.6,close";
    assert_eq!((raw.lines().count(), raw.lines().nth(59)), (162, Some(row)));
    let card = std::fs::read_to_string(out.join("README.md"))?;
    assert!(card.starts_with("---\nlicense: unknown\n") && card.contains("\n| lemon | 1 |\n"), "{card}");
    // Means over all derived samples, as version 0.1.0 exported them.
    let mut reader = csv::Reader::from_path(out.join("signals.csv"))?;
    let rows: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>()?;
    assert_eq!(rows.len(), 200);
    let expected = [5.864397, 5.375993, 2879.532, 3135.197, 0.488705, 0.532095];
    for (column, expected) in (5..).zip(expected) {
        let values = rows.iter().map(|row| row[column].parse::<f64>()).collect::<Result<Vec<_>, _>>()?;
        let mean = values.iter().sum::<f64>() / 200.0;
        assert!((mean - expected).abs() < 1e-3 * expected, "column {column}: {mean}, not {expected}");
    }

    let Trial { header, data: TrialData::Simulated(data) } = store.load(1)? else { panic!("simulated") };
    let trial = Trial { header, data };
    let scene = &trial.header.scene;
    let layout = SensorLayout::named("C1+F")?;
    let sensors = Sensors::new(&layout, &scene.gripper, SignalDefinition::Contact)?;
    let path = folder.path().join("trial_1.csv");
    write_trial_csv(&path, &trial, scene, &sensors)?;
    let mut reader = csv::Reader::from_path(&path)?;
    let row = reader.records().nth(60).ok_or("90 rows")??;
    let number = |column: usize| row[column].parse::<f64>();
    assert!(near(number(3)?, 5.054_612_216_715_664) && near(number(5)?, 3_693.857_000_559_81), "{row:?}");
    assert!(near(number(7)?, 0.090_442_039_072_513_58) && near(number(9)?, 0.041_673_644_267_971_426), "{row:?}");
    Ok(())
}
