//! `palpate serve`: the emulated gripper, and one behind a port, controlled by other programs.

#![cfg(unix)]

use crate::adapting::Emulator;
use crate::bench::HANG;
use crate::bench::{Bench, BenchSetup};
use crate::calibration::parts;
use crate::cpu_renderer::CpuRenderer;
use crate::gripper::{TRUE_TO_TIME, emulated};
use crate::program::{json, misused, palpate, ran, refused, run};
use crate::serial::{interrupt, start};
use egui::Key;
use palpate_serve::DeskSetup;
use palpate_store::Store;
use palpate_tactile::trial::{BoardLog, TrialData};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json as object};
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// A token that a test knows.
const TOKEN: &str = "0123456789abcdef";

/// A running `palpate serve`, killed when dropped.
struct Server {
    child: Child,
    address: String,
    store: PathBuf,
    /// What it has printed since it listens, once it has ended.
    said: Receiver<String>,
}

impl Server {
    fn start(folder: &Path, arguments: &[&str]) -> Self {
        let (store, token) = (folder.join("trials.sqlite"), folder.join("token.txt"));
        std::fs::write(&token, TOKEN).unwrap();
        let mut command = palpate(&store);
        command.args(["serve", "--listen", "0", "--accuracy", "draft", "--token"]).arg(&token).args(arguments);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = start(command);
        let mut said = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        while !line.starts_with("listening on ") {
            line.clear();
            assert!(said.read_line(&mut line).unwrap() > 0, "it has ended");
        }
        assert!(line.contains("gripper: ") && line.contains("store: "), "{line}");
        let (address, (rest, said_later)) = (line.split([' ', ',']).nth(2).unwrap().to_owned(), channel());
        // What else it says must not fill the pipe.
        std::thread::spawn(move || {
            let mut text = String::new();
            let _all = said.read_to_string(&mut text);
            rest.send(text)
        });
        Self { child, address, store, said: said_later }
    }

    fn connect(&self) -> Client {
        Client::connect(&self.address)
    }

    fn log(&self, trial: &Value) -> BoardLog {
        let store = Store::open_to_read(&self.store).unwrap();
        let TrialData::Recorded(log) = store.load(trial.as_i64().unwrap()).unwrap().data else { panic!("recorded") };
        log
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _dead = self.child.kill();
        let _gone = self.child.wait();
    }
}

/// A client, and the events that came before answers.
struct Client {
    writer: Box<dyn Write>,
    reader: Box<dyn BufRead>,
    number: u64,
    events: VecDeque<Value>,
}

impl Client {
    fn connect(address: &str) -> Self {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_nodelay(true).unwrap();
        stream.set_read_timeout(Some(HANG)).unwrap();
        let reader = BufReader::new(stream.try_clone().unwrap());
        Self { writer: Box::new(stream), reader: Box::new(reader), number: 0, events: VecDeque::new() }
    }

    fn send(&mut self, mut message: Value) -> u64 {
        self.number += 1;
        message["id"] = self.number.into();
        self.writer.write_all(format!("{message}\n").as_bytes()).unwrap();
        self.writer.flush().unwrap();
        self.number
    }

    fn read(&mut self) -> Value {
        let mut line = String::new();
        assert!(self.reader.read_line(&mut line).unwrap() > 0, "the connection has ended");
        serde_json::from_str(&line).unwrap()
    }

    fn await_answer(&mut self, id: u64) -> Value {
        loop {
            let message = self.read();
            if message["id"] == id {
                return message;
            }
            self.events.push_back(message);
        }
    }

    /// The answer to a request, which is done.
    fn ask(&mut self, message: Value) -> Value {
        let asked = message.to_string();
        let id = self.send(message);
        let message = self.await_answer(id);
        assert!(message["error"].is_null(), "{asked}: {message}");
        message["answer"].clone()
    }

    /// The error of a request, which is not done.
    fn fail(&mut self, message: Value) -> Value {
        let asked = message.to_string();
        let id = self.send(message);
        let message = self.await_answer(id);
        assert!(message["error"].is_object(), "{asked}: {message}");
        message["error"].clone()
    }

    /// The next event that meets a condition.
    fn event(&mut self, wanted: impl Fn(&Value) -> bool) -> Value {
        loop {
            let event = self.events.pop_front().unwrap_or_else(|| self.read());
            if wanted(&event) {
                return event;
            }
        }
    }

    /// Waits for a line pressure.
    fn until_bar(&mut self, wanted: impl Fn(f64) -> bool) {
        self.event(|event| event["event"] == "rows" && event["line_bar"].as_f64().is_some_and(&wanted));
    }
}

#[test]
fn a_program_grasps_records_labels_and_turns_the_object_as_advised() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &["--object", "lemon", "--speed", "20"]);
    let [mut client, mut watcher] = [server.connect(), server.connect()];
    for to in ["verdict", "trial"] {
        watcher.ask(object!({ "request": "subscribe", "to": to }));
    }
    assert!(client.fail(object!({ "request": "advise" }))["text"].as_str().unwrap().contains("no grasp"));
    assert!(client.fail(object!({ "request": "place", "move": {} }))["field"] == "move");
    let (mut trials, mut answered, mut moved, mut grasps) = (Vec::new(), Vec::new(), 0, 0);
    for k in 0..3 {
        let grasp = client.ask(object!({ "request": "grasp", "token": TOKEN, "again": k > 0 }));
        let trial = grasp["trial"].clone();
        client.ask(object!({ "request": "label", "object": "Lemon" }));
        for _ in 0..40 {
            let asked = Instant::now();
            let verdict = client.ask(object!({ "request": "recognise" }))["verdict"].clone();
            answered.push(asked.elapsed());
            assert_eq!(verdict, grasp["verdict"]);
        }
        let verdict = &grasp["verdict"];
        grasps += 1;
        assert_eq!(
            (verdict["grasps"].as_u64(), verdict["listening"].as_bool()),
            (Some(grasps), Some(false)),
            "{grasp}"
        );
        // After a decision, the next grasp is that of another object.
        grasps = if verdict["decided"].is_null() { grasps } else { 0 };
        let total: f64 = verdict["pmf"].as_object().unwrap().values().filter_map(Value::as_f64).sum();
        assert!((total - 1.0).abs() < 1e-6, "{verdict}");
        let advice = client.ask(object!({ "request": "advise" }))["advice"].clone();
        assert!(advice["text"].as_str().is_some_and(|text| !text.is_empty()), "{advice}");
        // Where the fingers would stand inside the object, it is put down anew.
        let id = client.send(object!({ "request": "place", "move": advice["move"] }));
        let placed = client.await_answer(id);
        moved += u32::from(placed["error"].is_null());
        assert!(placed["error"].is_null() || placed["error"]["field"] == "move", "{placed}");
        trials.push(trial);
    }
    assert!(moved > 0, "no advice could be followed");
    answered.sort();
    println!("an answer within {:?} at p95", answered[answered.len() * 95 / 100]);
    for trial in &trials {
        let begun = watcher.event(|event| event["event"] == "trial" && event["state"] == "begun");
        assert_eq!(&begun["trial"], trial);
        watcher.event(|event| event["event"] == "verdict" && event["listening"] == true);
        let ended = watcher.event(|event| event["event"] == "trial" && event["state"] == "ended");
        assert_eq!(&ended["trial"], trial);
        let log = server.log(trial);
        assert!(log.readings.len() > 250 && log.course.phases.len() > 20, "{} readings", log.readings.len());
    }
    let store = Store::open_to_read(&server.store).unwrap();
    let labels: Vec<_> = store.list(false).unwrap().into_iter().map(|row| row.object).collect();
    assert_eq!(labels.iter().filter(|label| label.as_str() == "lemon").count(), 3, "{labels:?}");
    // Nothing of it passes for data of a real gripper, and the close that it adapted by is none of the labelled grasps.
    assert!(store.list(false).unwrap().iter().all(|row| row.gripper() == "emulated"));
    let exported = run(folder.path(), &["trials", "export", "--labelled", "--out", "set"]);
    assert!(exported.code == Some(0) && exported.out.contains("3 trial(s)"), "{exported:?}");
    let card = std::fs::read_to_string(folder.path().join("set/README.md")).unwrap();
    assert!(card.contains("emulated gripper") && !card.contains("real gripper,"), "{card}");
    let shown = run(folder.path(), &["trials", "show", &trials[0].to_string()]).out;
    assert!(shown.contains("(emulated gripper on emulated, without a serial port)"), "{shown}");
}

#[test]
fn the_python_example_of_the_manual_runs_to_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let client = folder.path().join("palpate.py");
    std::fs::write(&client, include_str!("../../assets/clients/palpate.py")).unwrap();
    let python = |script: &Path, arguments: &[&str]| {
        std::process::Command::new("python3").arg(script).args(arguments).current_dir(folder.path()).output()
    };
    // Without a server it says so in a line. Nobody listens at a port that was free a moment ago.
    let free = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr()).unwrap().port().to_string();
    let Ok(alone) = python(&client, &["--port", &free]) else { return };
    let text = String::from_utf8_lossy(&alone.stderr).into_owned();
    assert!(text.starts_with(&format!("error: no `palpate serve` on 127.0.0.1:{free}")), "{text}");
    assert_eq!(text.lines().count(), 1, "{text}");
    // Advice for the box leads where the fingers have no room.
    let server = Server::start(folder.path(), &["--object", "box", "--speed", "20"]);
    let manual = include_str!("../../assets/help/control.md");
    let example = manual.split("```python\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let port = server.address.rsplit(':').next().unwrap();
    let example = example.replace("Palpate(token_file", &format!("Palpate({port}, token_file"));
    let script = folder.path().join("example.py");
    std::fs::write(&script, &example).unwrap();
    let ended = python(&script, &[]).unwrap();
    assert!(ended.status.success(), "{}\n{example}", String::from_utf8_lossy(&ended.stderr));
    let labelled = Store::open_to_read(&server.store).unwrap().labels().trials().unwrap();
    assert!(labelled.iter().any(|trial| trial.unsure && trial.object.is_some()), "the last trial is labelled");
}

#[test]
fn pressure_is_set_recorded_and_given_up_with_the_connection() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &["--object", "empty", "--speed", "10"]);
    let [mut watcher, mut client] = [server.connect(), server.connect()];
    watcher.ask(object!({ "request": "subscribe", "to": "rows" }));
    let row = watcher.event(|event| event["event"] == "rows");
    for name in ["curvature_left", "force_right", "flexL", "fsrR"] {
        assert!(row["values"][name].is_f64(), "{row}");
    }
    // Without the token no air moves.
    for request in [object!({ "request": "grasp" }), object!({ "request": "close" })] {
        let fault = client.fail(request);
        assert!(fault["field"] == "token" && fault["text"].as_str().unwrap().contains("token.txt\""), "{fault}");
    }
    let port = server.address.rsplit(':').next().unwrap();
    let second = run(folder.path(), &["serve", "--listen", port]);
    assert!(second.err.contains("in use") && second.err.contains("--listen N"), "{second:?}");
    assert!(second.code == Some(1) && !second.err.contains("token:"), "{second:?}");
    assert_eq!(client.fail(object!({ "request": "pressure", "bar": 0.3, "token": "x" }))["field"], "token");
    let tared = client.ask(object!({ "request": "tare" }));
    assert!(tared["notes"].to_string().contains("Tared"), "{tared}");

    // A course of pressures of its own, recorded.
    let trial = client.ask(object!({ "request": "record", "object": "empty" }))["trial"].clone();
    assert_eq!(client.ask(object!({ "request": "pressure", "bar": 0.4, "token": TOKEN }))["line_bar"], 0.4);
    watcher.until_bar(|bar| (bar - 0.4).abs() < 1e-9);
    let busy = client.fail(object!({ "request": "grasp", "token": TOKEN }));
    assert!(busy["text"].as_str().unwrap().contains("a trial is running"), "{busy}");
    client.ask(object!({ "request": "pressure", "bar": 0.2, "token": TOKEN }));
    watcher.until_bar(|bar| (bar - 0.2).abs() < 1e-9);
    assert_eq!(client.ask(object!({ "request": "record", "end": true }))["trial"], trial);
    assert_eq!(client.fail(object!({ "request": "record", "end": true }))["field"], "end");
    let bars: Vec<f64> = server.log(&trial).readings.iter().filter_map(|reading| reading.line_bar).collect();
    let steps = bars.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    assert!(bars.contains(&0.4) && steps < 0.11, "rises step by step: {bars:?}");

    // The connection of who moved air last is lost.
    client.ask(object!({ "request": "close", "token": TOKEN }));
    watcher.until_bar(|bar| (bar - 1.0).abs() < 1e-9);
    drop(client);
    watcher.until_bar(|bar| bar == 0.0);
    // The same within a grasp, which ends cut short.
    let mut client = server.connect();
    watcher.ask(object!({ "request": "subscribe", "to": "trial" }));
    client.send(object!({ "request": "grasp", "token": TOKEN }));
    watcher.until_bar(|bar| bar > 0.3);
    drop(client);
    watcher.event(|event| event["state"] == "cut-short");
    watcher.until_bar(|bar| bar == 0.0);
    // Vent needs no token, and tells the one who grasps.
    let mut client = server.connect();
    let id = client.send(object!({ "request": "grasp", "token": TOKEN }));
    watcher.until_bar(|bar| bar > 0.3);
    watcher.ask(object!({ "request": "vent" }));
    let vented = client.await_answer(id);
    assert!(vented["error"]["text"].as_str().is_some_and(|text| text.contains("Vent sent")), "{vented}");
    watcher.event(|event| event["state"] == "cut-short");
    // A grasp that touches nothing says so, and no move is advised after it.
    let missed = client.ask(object!({ "request": "grasp", "object": "lemon", "token": TOKEN }));
    let told = watcher.event(|event| event["state"] == "ended" && event["trial"] == missed["trial"]);
    assert!(missed["flags"] == told["flags"] && told["flags"][0]["flag"] == "no-contact", "{missed}, {told}");
    let advised = client.ask(object!({ "request": "advise" }));
    assert!(advised["advice"].is_null() && advised["notes"].to_string().contains("touched nothing"), "{advised}");
    // In the empty hand that is as it should be.
    let empty = client.ask(object!({ "request": "grasp", "object": "empty", "token": TOKEN }));
    assert!(empty["flags"].is_null(), "{empty}");
}

/// A line that is no request, nearly one, or one that moves air and has no token.
fn random_line(random: &mut ChaCha8Rng) -> Vec<u8> {
    let requests = [
        r#"{"id":1,"request":"pressure","bar":1.2}"#,
        r#"{"id":2,"request":"grasp","object":"lemon","again":true}"#,
        r#"{"id":3,"request":"close","bar":0.7,"token":"guessed and wrong"}"#,
        r#"{"id":4,"request":"record","seconds":-1}"#,
        r#"{"id":5,"request":"place","move":{"turn_deg":1e9}}"#,
        r#"{"id":6,"request":"label","trial":99999,"object":"lemon"}"#,
        r#"{"id":7,"request":"subscribe","to":"verdict"}"#,
        r#"{"id":8,"request":"recognise"}"#,
    ];
    let mut line = match random.random_range(0..10) {
        0 => (0..random.random_range(0..300)).map(|_| random.random()).collect(),
        1 => vec![b'['; random.random_range(1..5000)],
        2 if random.random_range(0..50) == 0 => vec![b'x'; 100_000],
        _ => requests[random.random_range(0..requests.len())].as_bytes().to_vec(),
    };
    for _ in 0..random.random_range(0..3) {
        if !line.is_empty() {
            let at = random.random_range(0..line.len());
            line[at] = random.random();
        }
    }
    line.push(b'\n');
    line
}

#[test]
fn ten_thousand_random_lines_stop_nobody_and_leave_no_valve_open() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &["--object", "empty", "--speed", "10"]);
    let [mut client, mut watcher] = [server.connect(), server.connect()];
    watcher.ask(object!({ "request": "subscribe", "to": "rows" }));
    client.ask(object!({ "request": "pressure", "bar": 0.5, "token": TOKEN }));
    watcher.until_bar(|bar| bar == 0.5);
    let mut storm = TcpStream::connect(&server.address).unwrap();
    let heard = storm.try_clone().unwrap();
    let (counted, answers) = channel();
    std::thread::spawn(move || {
        for line in BufReader::new(heard).lines().map_while(Result::ok) {
            let answer: Value = serde_json::from_str(&line).unwrap();
            let _still = counted.send(answer["error"].is_object());
        }
    });
    let mut random = ChaCha8Rng::seed_from_u64(43);
    for _ in 0..10_000 {
        storm.write_all(&random_line(&mut random)).unwrap();
    }
    storm.write_all(b"\n{\"id\":\"last\",\"request\":\"recognise\"}\n").unwrap();
    storm.shutdown(std::net::Shutdown::Write).unwrap();
    let answers: Vec<bool> = every(&answers);
    let errors = answers.iter().filter(|is_error| **is_error).count();
    println!("{} answers, {errors} of them errors", answers.len());
    assert!(answers.len() > 9000 && errors > 5000, "{} answers, {errors} errors", answers.len());
    // The others go on, and the air stays as its owner has set it.
    client.ask(object!({ "request": "recognise" }));
    watcher.events.clear();
    let bar = watcher.event(|event| event["event"] == "rows")["line_bar"].clone();
    assert_eq!(bar, 0.5);
    drop(client);
    watcher.until_bar(|bar| bar == 0.0);
}

/// Everything until the sender has gone.
fn every<T>(from: &Receiver<T>) -> Vec<T> {
    std::iter::from_fn(|| from.recv_timeout(HANG).ok()).collect()
}

#[test]
fn a_slow_reader_holds_up_nobody_and_at_most_sixteen_are_served() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &["--object", "empty", "--speed", "100"]);
    let [mut slow, mut quick] = [server.connect(), server.connect()];
    slow.ask(object!({ "request": "subscribe", "to": "rows" }));
    quick.ask(object!({ "request": "subscribe", "to": "rows" }));
    let began = Instant::now();
    let (mut rows, mut last_s) = (0, f64::NEG_INFINITY);
    while rows < 3000 || (began.elapsed() < Duration::from_secs(6) && rows < 30_000) {
        let row = quick.event(|_| true);
        assert_eq!(row["event"], "rows", "{row}");
        let t_s = row["t_s"].as_f64().unwrap();
        assert!(last_s.is_infinite() || (t_s - last_s - 0.02).abs() < 0.005, "{last_s} to {t_s}");
        (rows, last_s) = (rows + 1, t_s);
    }
    // The slow one is served as before.
    let id = slow.send(object!({ "request": "recognise" }));
    slow.await_answer(id);
    let lost: u64 = slow.events.iter().filter_map(|event| event["samples"].as_u64()).sum();
    println!("{rows} rows for the quick reader, {} and {lost} lost for the slow one", slow.events.len());
    // At most sixteen are served.
    let mut others: Vec<Client> = (0..14).map(|_| server.connect()).collect();
    others.iter_mut().for_each(|other| _ = other.ask(object!({ "request": "recognise" })));
    assert!(server.connect().read()["error"]["text"].as_str().unwrap().contains("16 clients"));
    others.pop();
    let again = Instant::now();
    while server.connect().read_after(&object!({ "id": 0, "request": "recognise" }))["error"].is_object() {
        assert!(again.elapsed() < HANG, "no place became free");
    }
}

impl Client {
    /// The first message after a request.
    fn read_after(&mut self, message: &Value) -> Value {
        // A refused connection may be closed by now.
        let _sent = self.writer.write_all(format!("{message}\n").as_bytes());
        self.read()
    }
}

#[test]
fn standard_input_is_served_until_it_ends() {
    let folder = tempfile::tempdir().unwrap();
    let token = folder.path().join("new.txt");
    let mut command = palpate(&folder.path().join("trials.sqlite"));
    command
        .args(["serve", "--stdio", "--accuracy", "draft", "--speed", "20", "--object", "empty", "--token"])
        .arg(&token);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut child = start(command);
    let reader = Box::new(BufReader::new(child.stdout.take().unwrap()));
    let writer = Box::new(child.stdin.take().unwrap());
    let mut client = Client { writer, reader, number: 0, events: VecDeque::new() };
    client.ask(object!({ "request": "recognise" }));
    let made = std::fs::read_to_string(&token).unwrap();
    assert_eq!(made.trim().len(), 32, "{made}");
    client.ask(object!({ "request": "subscribe", "to": "rows" }));
    client.ask(object!({ "request": "close", "bar": 0.3, "token": made.trim() }));
    client.until_bar(|bar| bar > 0.2);
    client.writer.write_all(b"nonsense\n{\"id\":9,\"request\":\"recognise\"}").unwrap();
    client.writer = Box::new(std::io::sink());
    // What was asked last is still answered.
    let error = client.event(|event| event["error"].is_object());
    assert!(error["id"].is_null() && error["error"]["field"].is_null(), "{error}");
    client.event(|event| event["id"] == 9);
    assert!(child.wait().unwrap().success());
}

/// On other systems the folder cannot be chosen.
#[cfg(target_os = "linux")]
#[test]
fn the_first_server_of_a_computer_makes_its_store() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_palpate"));
    command.args(["serve", "--stdio", "--object", "empty", "--speed", "20"]);
    command.env("XDG_DATA_HOME", folder.path()).stdin(Stdio::null());
    let served = ran(&command.output().unwrap());
    assert_eq!(served.code, Some(0), "{served:?}");
    assert!(folder.path().join("palpate/emulated.sqlite").is_file());
}

/// What a board has printed when Ctrl+C has ended the server that kept its fingers closed.
fn printed_after_ctrl_c() -> String {
    let folder = tempfile::tempdir().unwrap();
    let sent = folder.path().join("sent.txt");
    let emulator = Emulator::start(
        folder.path(),
        &["--grasp-every", "0", "--object", "empty", "--accuracy", "draft", "--sent", sent.to_str().unwrap()],
    );
    let mut server = Server::start(folder.path(), &["--port", emulator.port.to_str().unwrap()]);
    let mut client = server.connect();
    client.ask(object!({ "request": "subscribe", "to": "rows" }));
    let refused = client.fail(object!({ "request": "place" }));
    assert_eq!(refused["field"], "request");
    client.ask(object!({ "request": "close", "token": TOKEN }));
    client.until_bar(|bar| bar > 0.3);
    interrupt(&server.child);
    assert!(server.child.wait().unwrap().success());
    let said = server.said.recv().unwrap();
    assert!(said.ends_with("stopped; the fingers were told to vent\n"), "{said}");
    let began = Instant::now();
    let last_bar = || {
        let text = std::fs::read_to_string(&sent).unwrap_or_default();
        let line = text.lines().rev().find(|line| line.contains("p_bar:")).unwrap_or_default().to_owned();
        line.split("p_bar:").nth(1).and_then(|rest| rest.split(',').next()?.parse::<f64>().ok())
    };
    while last_bar() != Some(0.0) {
        assert!(began.elapsed() < HANG, "{:?} bar", last_bar());
        std::thread::sleep(Duration::from_millis(10));
    }
    std::fs::read_to_string(&sent).unwrap()
}

#[test]
fn ctrl_c_vents_a_gripper_at_a_port() {
    // Where the machine is too busy for board and host to hear each other in time, the watchdog of the board is first.
    let vents = |_| !printed_after_ctrl_c().contains("# vent");
    assert!((0..4).any(vents), "the program vents, not the watchdog of the board");
}

#[test]
fn beside_the_window_esc_vents_what_a_program_drives() {
    let setup = BenchSetup { listen: emulated(&parts(1, false), None, TRUE_TO_TIME, 30), ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    let (clients, address) = palpate_serve::listen(0).unwrap();
    let store = bench.store_folder().join("trials.sqlite");
    bench.tell(|app| {
        app.serve(DeskSetup { store, token: TOKEN.to_owned(), token_place: String::new(), emulated: None }, clients);
    });
    let mut client = Client::connect(&address.to_string());
    let early = client.fail(object!({ "request": "close", "token": TOKEN }));
    assert!(early["text"].as_str().unwrap().contains("no board is connected"), "{early}");
    bench.tell(|app| app.connect(None));
    bench.until_shown(true, "Stop and vent");
    client.ask(object!({ "request": "subscribe", "to": "rows" }));
    client.ask(object!({ "request": "close", "token": TOKEN }));
    client.until_bar(|bar| bar == 1.0);
    bench.harness.key_press(Key::Escape);
    bench.harness.step();
    bench.until_told("Vent sent");
    client.until_bar(|bar| bar == 0.0);
    // A grasp of a program is one of the window, which Esc ends for both.
    let id = client.send(object!({ "request": "grasp", "token": TOKEN }));
    client.until_bar(|bar| bar > 0.3);
    bench.harness.key_press(Key::Escape);
    bench.harness.step();
    let ended = client.await_answer(id);
    assert!(ended["error"]["text"].as_str().is_some_and(|text| text.contains("Vent sent")), "{ended}");
    // The window closes: nobody is served any more.
    drop(bench);
    let mut rest = String::new();
    client.reader.read_to_string(&mut rest).unwrap();
}

#[test]
fn wrong_use_is_refused_and_the_schema_is_printed() {
    let folder = tempfile::tempdir().unwrap();
    let schema = json(folder.path(), &["serve", "--schema"]);
    assert!(schema["properties"]["request"].is_object() && schema["properties"]["reply"].is_object(), "{schema}");
    misused(folder.path(), &["serve", "--stdio", "--listen", "1"], &["--listen"]);
    misused(folder.path(), &["serve", "--port", "p", "--speed", "2"], &["--speed"]);
    refused(folder.path(), &["serve", "--port", "/nowhere"], &["/nowhere"]);
    let short = folder.path().join("short.txt");
    std::fs::write(&short, "abc").unwrap();
    refused(folder.path(), &["serve", "--token", short.to_str().unwrap()], &["16 characters"]);
}
