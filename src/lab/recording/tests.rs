//! Trials of a real gripper: recorded, stored, merged, and killed half-way.

use super::board_writer::BoardWriter;
use super::*;
use palpate_device::protocol::CaptureReader;
use palpate_device::serial::{LinkOptions, PortError, SerialLink};
use palpate_sim::scene::Scene;
use palpate_store::Store;
use palpate_tactile::capture::{CAPTURE_MAGIC, Captured};
use palpate_tactile::trial::{Control, TrialSource};
use std::path::Path;
use std::sync::mpsc::channel;
use std::time::Duration;

fn line(i: u32) -> String {
    let part = if i % 50 == 7 { "nan".to_owned() } else { (2000 + i).to_string() };
    format!("t_us:{},seq:{i},flexL:{part},flexR:2100,fsrL:12.5,fsrR:0,p_bar:0.55\n", 20_000 * u64::from(i))
}

/// Captured bytes of a board that loses its line 100 and vanishes for two seconds after line 199.
fn capture(path: &Path) -> std::io::Result<()> {
    let mut file = CAPTURE_MAGIC.to_vec();
    let bytes = |t: f64, text: &str| Captured::Bytes { arrived_s: t, bytes: text.as_bytes().to_vec() };
    bytes(0.0, "ut\n").write(&mut file)?;
    for i in (0..400).filter(|i| *i != 100 && !(200..300).contains(i)) {
        if i == 300 {
            Captured::Interrupted { at_s: 4.1, cause: "the board was unplugged".to_owned() }.write(&mut file)?;
            bytes(5.99, "half a line\n").write(&mut file)?;
        }
        bytes(0.02 * f64::from(i), &line(i)).write(&mut file)?;
    }
    std::fs::write(path, file)
}

fn replayed(path: &Path) -> Result<SerialLink, PortError> {
    SerialLink::open(&LinkOptions {
        path: Some(path.to_owned()),
        replay_speed: f64::INFINITY,
        ..LinkOptions::default()
    })
}

fn plan(link: &SerialLink, object: &str) -> BoardTrialPlan {
    let scene = Scene::default();
    BoardTrialPlan {
        object: object.to_owned(),
        scene,
        seconds: Some(8.0),
        status: link.status(),
        began_s: 0.0,
        control: Control::Free,
    }
}

/// Records a capture as fast as it can be played.
fn record(store: &mut Store, path: &Path) -> Result<RecordedTrial, Box<dyn std::error::Error>> {
    let link = replayed(path)?;
    let mut writer = BoardWriter::begin(store, &plan(&link, "lemon"))?;
    while !link.is_over() {
        link.take(Duration::from_millis(20)).into_iter().for_each(|event| writer.take(event));
        writer.flush(store)?;
    }
    Ok(writer.finish(store, &link.status(), &[])?)
}

#[test]
fn a_trial_keeps_every_reading_every_gap_and_every_byte() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let (bytes, path) = (folder.path().join("grasp.bytes"), folder.path().join("trials.sqlite"));
    capture(&bytes)?;
    let mut store = Store::open(&path)?;
    let recorded = record(&mut store, &bytes)?;
    let trial = store.board_log(recorded.id)?.ok_or("it is one of a board")?;
    assert_eq!((trial.readings.len(), trial.course.cadence.samples, trial.course.cadence.lost), (299, 299, 101));
    let lost: Vec<Option<u64>> = trial.gaps.iter().map(|gap| gap.lost).collect();
    assert_eq!(lost, [Some(1), Some(100)]);
    assert!(trial.gaps[1].cause.contains("unplugged"));
    for reading in &trial.readings {
        let i = reading.seq.ok_or("it counts")? as u32;
        let first = (i % 50 != 7).then_some((2000 + i) as f32);
        assert_eq!(reading.counts, [first, Some(2100.0), Some(12.5), Some(0.0)]);
        assert!((reading.t_s - 0.02 * f64::from(i)).abs() < 1e-6 && reading.line_bar == Some(0.55));
    }
    assert!(recorded.warnings.iter().any(|warning| warning.starts_with("interrupted")), "{:?}", recorded.warnings);
    let row = &store.list(false)?[0];
    let found = (row.source, row.object.as_str(), row.state.as_str(), row.samples, row.sound);
    assert_eq!(found, (TrialSource::Recorded, "lemon", "complete", 299, true));
    // The bytes are those that came, mark by mark.
    let stored = store.board_bytes(recorded.id)?.ok_or("it has bytes")?;
    let pieces = |bytes: &[u8]| CaptureReader::new(bytes)?.collect::<std::io::Result<Vec<Captured>>>();
    assert_eq!(pieces(&stored)?, pieces(&std::fs::read(&bytes)?)?);
    Ok(())
}

#[test]
fn trials_of_a_board_are_merged_and_purged() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let at = |name: &str| folder.path().join(name);
    capture(&at("grasp.bytes"))?;
    let mut here = Store::open(&at("here.sqlite"))?;
    let id = record(&mut here, &at("grasp.bytes"))?.id;
    let mut all = Store::open(&at("all.sqlite"))?;
    record(&mut all, &at("grasp.bytes"))?;
    assert_eq!(all.merge_from(&at("here.sqlite"))?.added, 1);
    assert_eq!(all.board_log(2)?, here.board_log(id)?);
    assert_eq!(all.board_bytes(2)?, here.board_bytes(id)?);
    // Deleting and purging take everything along.
    all.delete(&[2])?;
    assert!(all.board_log(2)?.is_none());
    all.purge()?;
    let left: i64 = rusqlite::Connection::open(at("all.sqlite"))?.query_row(
        "SELECT count(DISTINCT trial) FROM board_chunks",
        [],
        |r| r.get(0),
    )?;
    assert_eq!(left, 1);
    Ok(())
}

#[test]
fn what_a_kill_leaves_is_all_but_the_last_second() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let (bytes, path) = (folder.path().join("grasp.bytes"), folder.path().join("trials.sqlite"));
    capture(&bytes)?;
    let mut store = Store::open(&path)?;
    let whole = record(&mut store, &bytes)?.id;
    let link = replayed(&bytes)?;
    let mut writer = BoardWriter::begin(&mut store, &plan(&link, "cube"))?;
    let mut readings = 0;
    while !link.is_over() {
        for event in link.take(Duration::from_millis(20)) {
            let reading = event.reading().is_some();
            writer.take(event);
            readings += u32::from(reading);
            if reading && readings % 50 == 0 {
                writer.flush(&mut store)?;
            }
        }
    }
    // Nothing of what was not written is there, all of what was is, and the other trial is whole.
    drop(writer);
    drop(store);
    let store = Store::open(&path)?;
    assert_eq!(store.board_log(2)?.map(|trial| trial.readings.len()), Some(250));
    assert_eq!(store.board_log(whole)?.map(|trial| trial.readings.len()), Some(299));
    assert!(store.board_bytes(2)?.is_some());
    let states: Vec<String> = store.list(false)?.into_iter().map(|row| row.state).collect();
    assert_eq!(states, ["complete", "recording"]);
    Ok(())
}

/// Records a capture through the recorder; `event` happens once the trial has begun. Returns the last notice.
fn recorded_amid(
    path: &Path,
    bytes: &Path,
    event: impl Fn() -> Result<(), Box<dyn std::error::Error>>,
) -> Result<RecorderNotice, Box<dyn std::error::Error>> {
    let link = replayed(bytes)?;
    let (sender, notices) = channel();
    let recorder = Recorder::start(path.to_owned(), move |notice| sender.send(notice).expect("heard"))?;
    recorder.begin_board(plan(&link, "lemon"));
    assert_eq!(notices.recv()?, RecorderNotice::Begun(1));
    event()?;
    while !link.is_over() {
        link.take(Duration::from_millis(20)).into_iter().for_each(|event| recorder.board(event));
    }
    let end = BoardTrialEnd { status: link.status(), notes: Vec::new(), guess: None, discarded: false };
    recorder.finish_board(end);
    drop(recorder);
    Ok(notices.try_iter().last().ok_or("no notice")?)
}

#[test]
fn a_recording_that_cannot_be_stored_says_what_is_kept() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let (bytes, path) = (folder.path().join("grasp.bytes"), folder.path().join("trials.sqlite"));
    capture(&bytes)?;
    drop(Store::open(&path)?);
    let notice = recorded_amid(&path, &bytes, || {
        // As a full disk does.
        let full = "CREATE TRIGGER full BEFORE INSERT ON board_chunks BEGIN SELECT raise(ABORT, 'no room'); END";
        Ok(rusqlite::Connection::open(&path)?.execute_batch(full)?)
    })?;
    let RecorderNotice::Failed(text) = notice else { panic!("{notice:?}") };
    assert!(text.contains("no room") && text.contains("0 of 299 samples are kept as trial 1 (cut short)"), "{text}");
    Ok(())
}

#[cfg(unix)]
#[test]
fn a_store_that_is_deleted_while_it_is_recorded_into_is_noticed() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let (bytes, path) = (folder.path().join("grasp.bytes"), folder.path().join("trials.sqlite"));
    capture(&bytes)?;
    let notice = recorded_amid(&path, &bytes, || Ok(std::fs::remove_file(&path)?))?;
    let RecorderNotice::Failed(text) = notice else { panic!("{notice:?}") };
    assert!(text.contains("was deleted or moved while it was open") && !text.contains("are kept"), "{text}");
    assert!(!path.exists());
    Ok(())
}

#[test]
fn captured_bytes_that_are_cut_or_joined_are_recorded_with_a_warning() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let bytes = folder.path().join("grasp.bytes");
    capture(&bytes)?;
    let whole = std::fs::read(&bytes)?;
    for (content, readings, said) in [
        (whole[..whole.len() / 2].to_vec(), 140..160, "end within a record"),
        ([&*whole, &*whole].concat(), 299..300, "joined"),
    ] {
        std::fs::write(&bytes, content)?;
        let mut store = Store::open(&folder.path().join("trials.sqlite"))?;
        let recorded = record(&mut store, &bytes)?;
        let text = recorded.warnings.join("\n");
        assert!(text.contains(said) && text.contains("what follows is missing"), "{text}");
        assert!(readings.contains(&store.board_log(recorded.id)?.ok_or("of a board")?.readings.len()), "{said}");
        assert!(recorded.about.flags.iter().any(|found| found.flag == palpate_store::labels::Flag::Interrupted));
    }
    Ok(())
}

#[test]
fn a_store_that_another_program_writes_to_holds_up_no_board_and_loses_nothing() -> Result<(), Box<dyn std::error::Error>>
{
    let folder = tempfile::tempdir()?;
    let (bytes, path) = (folder.path().join("grasp.bytes"), folder.path().join("trials.sqlite"));
    capture(&bytes)?;
    drop(Store::open(&path)?);
    let link = replayed(&bytes)?;
    let (sender, notices) = channel();
    let recorder = Recorder::start(path.clone(), move |notice| sender.send(notice).expect("heard"))?;
    let other = rusqlite::Connection::open(&path)?;
    other.execute_batch("BEGIN IMMEDIATE")?;
    recorder.begin_board(plan(&link, "lemon"));
    while !link.is_over() {
        link.take(Duration::from_millis(20)).into_iter().for_each(|event| recorder.board(event));
    }
    let end = BoardTrialEnd { status: link.status(), notes: Vec::new(), guess: None, discarded: false };
    recorder.finish_board(end);
    // Everything was handed over while the store was locked, and nothing was written.
    assert!(notices.try_recv().is_err());
    other.execute_batch("COMMIT")?;
    drop(recorder);
    let Some(RecorderNotice::Recorded(trial)) = notices.try_iter().last() else { panic!("recorded") };
    let store = Store::open(&path)?;
    assert_eq!(store.board_log(trial.id)?.map(|trial| trial.readings.len()), Some(299));
    Ok(())
}
