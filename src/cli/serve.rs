//! `palpate serve`: control of the gripper from other programs.

use super::link::{PATIENCE_S, USUAL_WAIT_S};
use super::prelude::*;
use super::recognise::{load_model, warn_of_perfect_sensors};
use palpate_lab::gripper::{Listen, listen_to_port};
use palpate_lab::workers::{GripperCommand, GripperSetup, GripperWorker, Notice};
use palpate_learn::Shipped;
use palpate_serve::{Clients, Desk, DeskSetup, EmulatedHand, MOST_CLIENTS, listen, listen_to_input, schema};
use std::hash::{BuildHasher, RandomState};
use std::io::{ErrorKind, Write as _};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time between two looks at the connection.
const POLL: Duration = Duration::from_millis(20);
/// Least length of a token (characters).
const SHORTEST_TOKEN: usize = 16;
/// Largest file of a token (bytes).
const LARGEST_TOKEN: u64 = 4096;

/// The client for Python.
const CLIENT: &str = include_str!("../../assets/clients/palpate.py");

/// Arguments of `palpate serve`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate serve
  palpate serve --object lemon --speed 5
  palpate serve --port /dev/ttyACM0 --token token.txt
  palpate serve --stdio --token token.txt
  palpate serve --schema

See also: palpate help control")]
pub(super) struct ServeArguments {
    /// Port of the real gripper (default: the emulated gripper, with a store of its own).
    #[arg(long, value_name = "PORT", conflicts_with_all = ["object", "seed", "speed"])]
    port: Option<PathBuf>,
    /// TCP port to listen on, for programs on this computer; 0: any free one.
    #[arg(long, value_name = "N", default_value_t = 4747)]
    listen: u16,
    /// Serve one client on standard input and output instead, until the input ends.
    #[arg(long, conflicts_with = "listen")]
    stdio: bool,
    /// File of the token that requests need which move air; made where there is none (default: a new token, printed at the
    /// start).
    #[arg(long, value_name = "FILE")]
    token: Option<PathBuf>,
    /// Object in the emulated hand: a built-in name, or a URDF, OBJ or STL file.
    #[arg(long, value_name = "NAME|FILE")]
    object: Option<String>,
    #[command(flatten)]
    scene: SceneArguments,
    /// Random seed of the emulated sensors and of poses.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Speed of the emulated gripper, as a factor of real time.
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = within(0.01..=100.0))]
    speed: f64,
    /// Most grasps of an object until the model decides.
    #[arg(long, value_name = "K", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=100))]
    grasps: u32,
    /// Recognition model (default: the shipped one for any gripper).
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Print the JSON schema of all messages, then exit.
    #[arg(long)]
    schema: bool,
    /// Print the client for Python, then exit.
    #[arg(long)]
    client: bool,
}

impl ServeArguments {
    /// Store of the emulated gripper, whose trials and calibrations are not those of the real one.
    pub(super) fn own_store(&self) -> Option<PathBuf> {
        self.port.is_none().then(|| Store::default_path().with_file_name("emulated.sqlite"))
    }
}

pub(super) fn run(arguments: &ServeArguments, store: Option<&Path>) -> Result<(), Failure> {
    if arguments.schema {
        return say_json(&schema());
    }
    if arguments.client {
        return say_as_is(CLIENT.trim_end());
    }
    let scene = arguments.scene.scene(arguments.object.as_deref())?;
    let model = load_model(arguments.model.as_deref(), Shipped::AnyGripper)?;
    warn_of_perfect_sensors(&model);
    let mut opened = open_store(store)?;
    let store = opened.path().to_owned();
    // Before the token, which serves nobody where the port is in use.
    let (clients, address) = match arguments.stdio {
        true => (listen_to_input()?, None),
        false => bound(arguments.listen, "--listen N").map(|(clients, address)| (clients, Some(address)))?,
    };
    let (token, token_place) = token(arguments.token.as_deref())?;
    let stop = stop_flag()?;
    let emulated = match arguments.port {
        Some(_) => None,
        None => Some(EmulatedHand::new(&scene, arguments.seed, arguments.speed, &mut opened)?),
    };
    drop(opened);
    let gripper: Listen = emulated.as_ref().map_or_else(|| Arc::new(listen_to_port) as Listen, EmulatedHand::listen);
    let desk = DeskSetup { store: store.clone(), token, token_place, emulated };
    let worker = GripperWorker::start(GripperSetup {
        scene,
        store: store.clone(),
        model: Some(Arc::new(model)),
        grasps: arguments.grasps,
        listen: gripper,
        wake: Arc::new(|| ()),
    })?;
    connect(&worker, arguments.port.clone(), &stop)?;
    let gripper = arguments.port.as_ref().map_or("the emulated gripper".to_owned(), |port| port.display().to_string());
    if let Some(address) = address {
        listens(address, &format!("gripper: {gripper}, store: {}", store.display()));
    }
    let vents = Desk::new(desk, clients, |wake| worker.tap(wake)).serve(|| {
        // They go to the clients.
        worker.rows().for_each(drop);
        for notice in worker.notices() {
            if let Notice::Failed(text) = notice {
                warn(&text);
            }
        }
        !stop.load(Ordering::Relaxed) && !worker.has_ended()
    });
    let failed = worker.has_ended();
    if stop.load(Ordering::Relaxed) {
        note(if vents { "stopped; the fingers were told to vent" } else { "stopped" });
    }
    // Vents and ends a running trial.
    drop(worker);
    if failed { Err("the gripper's thread has stopped; the board vents within a second".into()) } else { Ok(()) }
}

/// Clients of the window, and what they are served from.
pub(super) fn beside_window(
    port: u16,
    token_file: Option<&Path>,
    store: &Path,
) -> Result<(DeskSetup, Clients), Failure> {
    let (clients, address) = bound(port, "--serve=N")?;
    let (token, token_place) = token(token_file)?;
    listens(address, &format!("gripper: that of the window, store: {}", store.display()));
    Ok((DeskSetup { store: store.to_owned(), token, token_place, emulated: None }, clients))
}

/// Listens on a TCP port; `option` chooses another one.
fn bound(port: u16, option: &str) -> Result<(Clients, SocketAddr), Failure> {
    Ok(listen(port).map_err(|error| match error.kind() {
        ErrorKind::AddrInUse => {
            format!("port {port} is in use, by another server perhaps: choose another one with {option}")
        }
        _ => format!("cannot listen on port {port}: {error}"),
    })?)
}

/// Says that clients are served, and with what.
fn listens(address: SocketAddr, with: &str) {
    note(&format!("listening on {address}, for {MOST_CLIENTS} clients at most; {with}"));
}

/// Connects, and waits for the port while another program has it.
fn connect(worker: &GripperWorker, port: Option<PathBuf>, stop: &AtomicBool) -> Result<(), Failure> {
    worker.send(GripperCommand::Connect(port));
    let (begun, mut noted) = (Instant::now(), false);
    while !stop.load(Ordering::Relaxed) {
        let view = worker.view().unwrap_or_default();
        let waited = begun.elapsed().as_secs_f64();
        if view.is_connected() && (view.latest.is_some() || waited > PATIENCE_S) {
            view.remarks.iter().for_each(|remark| warn(remark));
            return Ok(());
        }
        if let Some(refused) = &view.refused {
            if !refused.may_pass || waited > USUAL_WAIT_S {
                return Err(refused.text.clone().into());
            }
            if !std::mem::replace(&mut noted, true) {
                note(&refused.text);
            }
        }
        std::thread::sleep(POLL);
    }
    Err("stopped".into())
}

/// The token of a file, which is made where there is none; without a file a new one, which is printed. And where it is found.
fn token(file: Option<&Path>) -> Result<(String, String), Failure> {
    let new = || (0..2).map(|k: u32| format!("{:016x}", RandomState::new().hash_one(k))).collect::<String>();
    let Some(path) = file else {
        let token = new();
        note(&format!("token: {token}"));
        return Ok((token, "that `palpate serve` printed at its start".to_owned()));
    };
    let (shown, place) = (path.display(), format!("in \"{}\"", path.display()));
    if path.exists() {
        let token = palpate_geometry::read_text(path, LARGEST_TOKEN)?.trim().to_owned();
        if token.chars().count() < SHORTEST_TOKEN {
            return Err(format!(
                "\"{shown}\" has no token of {SHORTEST_TOKEN} characters: remove it, and a new one is made"
            )
            .into());
        }
        return Ok((token, place));
    }
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let token = new();
    let written = options.open(path).and_then(|mut file| writeln!(file, "{token}"));
    written.map_err(|error| format!("cannot write \"{shown}\": {error}"))?;
    Ok((token, place))
}
