//! A link over a real pseudo-terminal.

use super::*;
use crate::protocol::{BoardEvent, BoardReply};
use palpate_tactile::board::{Gap, Reading};
use palpate_tactile::capture::Captured;
use serialport::{SerialPort, TTYPort};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// After this long something hangs, however busy the machine is.
const HANG: Duration = Duration::from_secs(300);

/// An emulated board: what is written to its first part comes out of the port at the link.
struct Emulated {
    board: TTYPort,
    /// Keeps the port alive while nobody else has it open.
    port: TTYPort,
}

fn emulated(link: &Path) -> Emulated {
    let (board, port) = TTYPort::pair().expect("a pseudo-terminal");
    let _old = std::fs::remove_file(link);
    std::os::unix::fs::symlink(port.name().expect("has a name"), link).expect("links");
    Emulated { board, port }
}

fn options(path: &Path) -> LinkOptions {
    LinkOptions { path: Some(path.to_owned()), ..LinkOptions::default() }
}

fn line(i: u32, channels: u32) -> String {
    let counts: Vec<String> = (0..channels).map(|c| format!("ch{c}:{}", (i + 100 * c) % 4096)).collect();
    format!("t_us:{},seq:{i},{}\n", 1000 * u64::from(i), counts.join(","))
}

/// Takes until `done` says so of everything taken, or something hangs.
fn take_until(link: &SerialLink, mut done: impl FnMut(&[BoardEvent]) -> bool) -> Vec<BoardEvent> {
    let (mut taken, start) = (Vec::new(), Instant::now());
    while !done(&taken) && start.elapsed() < HANG {
        taken.extend(link.take(Duration::from_millis(20)));
    }
    taken
}

fn readings(events: &[BoardEvent]) -> Vec<&Reading> {
    events.iter().filter_map(BoardEvent::reading).collect()
}

fn gaps(events: &[BoardEvent]) -> Vec<&Gap> {
    events.iter().filter_map(|e| if let BoardEvent::Gap(gap) = e { Some(gap) } else { None }).collect()
}

#[test]
fn a_board_that_vanishes_is_found_again_and_leaves_one_gap() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("due");
    let mut first = emulated(&path);
    let link = SerialLink::open(&options(&path)).expect("opens");
    assert_eq!(link.status().state, LinkState::Waiting);
    first.board.write_all(b"\n").expect("writes");
    for i in 0..50 {
        first.board.write_all(line(i, 4).as_bytes()).expect("writes");
    }
    let mut taken = take_until(&link, |events| readings(events).len() == 50);
    drop(first);
    take_until(&link, |_| matches!(link.status().state, LinkState::Lost { .. }));
    let mut second = emulated(&path);
    let back = take_until(&link, |_| link.status().reconnects == 1);
    taken.extend(back);
    second.board.write_all(b"cut\n").expect("writes");
    for i in 80..100 {
        second.board.write_all(line(i, 4).as_bytes()).expect("writes");
    }
    taken.extend(take_until(&link, |events| readings(events).len() == 20));
    let gaps = gaps(&taken);
    assert_eq!(readings(&taken).len(), 70);
    assert_eq!((gaps.len(), gaps[0].lost), (1, Some(30)), "{gaps:?}");
    assert!(gaps[0].cause.contains("unplugged"), "{gaps:?}");
    take_until(&link, |_| link.status().state == LinkState::Listening);
    assert_eq!(link.status().state, LinkState::Listening);
}

#[test]
fn lines_go_to_the_board_and_its_remarks_come_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("due");
    let mut emulated = emulated(&path);
    let link = SerialLink::open(&options(&path)).expect("opens");
    let start = Instant::now();
    while link.send("P 0.55").is_err() && start.elapsed() < HANG {}
    let mut received = [0; 7];
    emulated.board.read_exact(&mut received).expect("receives the command");
    assert_eq!(&received, b"P 0.55\n");
    emulated.board.write_all(b"# ok p=0.55\n").expect("writes");
    let said = |events: &[BoardEvent]| events.contains(&BoardEvent::Reply(BoardReply::Acknowledged { line_bar: 0.55 }));
    assert!(said(&take_until(&link, said)));
    drop(emulated.port);
}

#[test]
fn ports_that_cannot_be_opened_say_why() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("due");
    let trouble = |path: &Path| SerialLink::open(&options(path)).map(drop).map_err(|error| error.trouble);
    assert_eq!(trouble(&path), Err(PortTrouble::NotFound));
    assert_eq!(trouble(folder.path()), Err(PortTrouble::NotSerial));
    assert_eq!(trouble(Path::new("/dev/null")), Err(PortTrouble::NotSerial));
    let _emulated = emulated(&path);
    let _link = SerialLink::open(&options(&path)).expect("opens");
    assert_eq!(trouble(&path), Err(PortTrouble::Busy));
}

#[test]
fn a_thousand_readings_a_second_with_eight_channels_all_arrive() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("due");
    let mut emulated = emulated(&path);
    emulated.board.set_timeout(HANG).expect("waits for a reader that is late");
    let link = SerialLink::open(&options(&path)).expect("opens");
    let count = 1500;
    let writer = std::thread::spawn(move || {
        let start = Instant::now();
        emulated.board.write_all(b"\n").expect("writes");
        for i in 0..count {
            emulated.board.write_all(line(i, 8).as_bytes()).expect("writes");
            let due = start + Duration::from_millis(u64::from(i));
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
        emulated
    });
    let taken = take_until(&link, |events| readings(events).len() == count as usize);
    drop(writer.join());
    for (reading, i) in readings(&taken).iter().zip(0u16..) {
        assert_eq!(reading.seq, Some(u64::from(i)));
        assert_eq!(reading.counts[7], Some(f32::from((i + 700) % 4096)));
    }
    assert!(readings(&taken).len() == count as usize && gaps(&taken).is_empty());
    assert_eq!(link.status().dropped, [0, 0]);
}

#[test]
fn captured_bytes_are_heard_as_from_a_port() {
    let folder = tempfile::tempdir().expect("a folder");
    let path: PathBuf = folder.path().join("grasp.bytes");
    let text: String = std::iter::once("cut\n".to_owned()).chain((0..400).map(|i| line(i, 4))).collect();
    std::fs::write(&path, text).expect("writes");
    let link = SerialLink::open(&LinkOptions { replay_speed: f64::INFINITY, ..options(&path) }).expect("opens");
    let taken = take_until(&link, |_| link.is_over());
    assert_eq!((readings(&taken).len(), gaps(&taken).len()), (400, 0));
    assert!(matches!(link.status().state, LinkState::Ended { .. }));
    let bytes: usize = taken
        .iter()
        .map(|event| match event {
            BoardEvent::Captured(Captured::Bytes { bytes, .. }) => bytes.len(),
            _ => 0,
        })
        .sum();
    assert_eq!(bytes as u64, std::fs::metadata(&path).expect("is there").len());
}

/// Speaks at a speed, 20 lines of 30 bytes, if the link listens at it, and else nonsense.
fn speak_at(board: &mut TTYPort, speed: u32, from: u32) {
    for i in from..from + 20 {
        let right = board.baud_rate().is_ok_and(|baud| baud == speed);
        let bytes: Vec<u8> =
            line(i, 3).bytes().map(|byte| if right { byte } else { byte.rotate_left(3) | 0x80 }).collect();
        let _unheard = board.write_all(&bytes);
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_board_that_goes_on_at_another_speed_is_found_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("due");
    let mut emulated = emulated(&path);
    let link = SerialLink::open(&options(&path)).expect("opens");
    let (mut events, start, mut sent) = (Vec::new(), Instant::now(), 0);
    while link.status().state != LinkState::Listening && start.elapsed() < HANG {
        speak_at(&mut emulated.board, 115_200, sent);
        sent += 20;
    }
    // Another sketch: the same numbers, at another speed.
    let before = link.status().cadence.samples;
    while link.status().baud != Some(57_600) && start.elapsed() < HANG {
        speak_at(&mut emulated.board, 57_600, sent);
        sent += 20;
    }
    let is_back = |events: &[BoardEvent]| !gaps(events).is_empty() && link.status().state == LinkState::Listening;
    while !is_back(&events) && start.elapsed() < HANG {
        speak_at(&mut emulated.board, 57_600, sent);
        sent += 20;
        events.extend(link.take(Duration::from_millis(20)));
    }
    let status = link.status();
    assert_eq!((status.state, status.baud), (LinkState::Listening, Some(57_600)));
    assert!(before > 0 && status.cadence.samples > before, "{before} {}", status.cadence.samples);
    let cause = gaps(&events).first().map(|gap| gap.cause.clone()).unwrap_or_default();
    assert!(cause.contains("57600"), "{cause}");
}
