//! `palpate emulate`: emulates the gripper on a pseudo-terminal. Unix only.

use super::prelude::*;
use palpate_device::doctor::check_firmware;
use palpate_device::emulator::{
    EmulatedFault, EmulatedGripper, EmulatorSetup, HandPlan, HiddenParts, Step, fault_help, parse_faults, parse_script,
};
#[cfg(unix)]
use palpate_device::emulator::{EmulatorEvent, EmulatorEventKind, PortSetup, serve};
use palpate_geometry::read_text;
use palpate_sim::objects::anchored;
use palpate_tactile::board::SensorList;

/// Arguments of `palpate emulate`.
#[derive(Debug, clap::Args)]
#[command(after_help = after_help())]
pub(super) struct EmulateArguments {
    /// Symbolic link to create: the port that a host opens.
    #[arg(long, value_name = "FILE", required_unless_present = "print_secrets")]
    link: Option<PathBuf>,
    /// What is in the hand, grasp by grasp: names or files, separated by commas; `empty` in front of others for the first
    /// close by a host only, to adapt to (default: the sixteen by itself, nothing while a host drives).
    #[arg(long = "object", value_name = "A,B,..", value_delimiter = ',')]
    objects: Vec<String>,
    #[command(flatten)]
    scene: SceneArguments,
    /// Random seed of poses, sensors, noise and faults.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Samples per second.
    #[arg(long, value_name = "HZ", default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=1000))]
    rate: u32,
    /// Number of channels: the sensors of the gripper, then spare inputs that swing slowly (default: the sensors).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=16))]
    channels: Option<u8>,
    /// Period of automatic grasps (s); 0: only a host drives the fingers.
    #[arg(long, value_name = "S", default_value_t = 6.0, value_parser = within(0.0..=3600.0))]
    grasp_every: f64,
    /// Bench procedure, as text or a file: angle=30 hold=2; load=0.1kg hold=3; close empty. `-` reads steps from standard
    /// input.
    #[arg(long, value_name = "STEPS|FILE|-")]
    script: Option<String>,
    /// Faults: NAME[=VALUE]@SECONDS[/DURATION], separated by commas, as in vanish@5,garbage@7/2; see below.
    #[arg(long, value_name = "LIST", value_parser = parse_faults_once, default_value = "", hide_default_value = true)]
    faults: Faults,
    /// Read the hidden values of strips, pads and dividers from this file instead of drawing them at random.
    #[arg(long, value_name = "F.json")]
    secrets: Option<PathBuf>,
    /// Print the hidden values as JSON, then exit.
    #[arg(long)]
    print_secrets: bool,
    /// Imperfections to leave out, separated by commas.
    #[arg(long, value_name = "A,B,..", value_delimiter = ',')]
    without: Vec<Imperfection>,
    /// Highest pressure the board puts out (bar); 0: manual control box, the board refuses pressure commands.
    #[arg(long, value_name = "BAR", default_value_t = 1.5, value_parser = within(0.0..=1.5))]
    max_bar: f64,
    /// Baud rate: a host with another rate reads garbage (default: any rate works, as on the native port).
    #[arg(long, value_name = "BAUD")]
    baud: Option<u32>,
    /// Silence after a host opens the port (s), as on the programming port, which restarts the board.
    #[arg(long, value_name = "S", default_value_t = 0.0, value_parser = within(0.0..=3600.0))]
    boot: f64,
    /// Start of the board's 32-bit clock (µs); near 4294967295 it wraps soon.
    #[arg(long, value_name = "US", default_value_t = 0)]
    clock_start: u32,
    /// Speed of the emulation, as a factor of real time.
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = within(0.01..=100.0))]
    speed: f64,
    /// Write every line of the board to FILE, before any fault corrupts it.
    #[arg(long, value_name = "FILE.txt", value_parser = file_of(&[FileKind::BoardLines]))]
    sent: Option<PathBuf>,
    /// Print events as JSON, one object per line.
    #[arg(long)]
    json: bool,
}

/// The faults of one argument.
#[derive(Clone, Debug)]
struct Faults(Vec<EmulatedFault>);

fn parse_faults_once(text: &str) -> Result<Faults, String> {
    parse_faults(text).map(Faults).map_err(|error| error.to_string())
}

/// Imperfections of the sensors that can be left out.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Imperfection {
    Noise,
    Hysteresis,
    Drift,
}

fn after_help() -> String {
    format!(
        "Faults, with the defaults of VALUE and DURATION:\n{}\n\nExamples:\n  palpate emulate --link /tmp/gripper\n  palpate \
         emulate --link /tmp/gripper --object ball,cube --faults vanish@20/3\n  palpate emulate --link /tmp/gripper \
         --script \"angle=30 hold=2; close empty\"",
        fault_help()
    )
}

pub(super) fn run(arguments: &EmulateArguments, sensors: SensorList) -> Result<(), Failure> {
    let parts = parts(arguments)?;
    check_firmware(sensors)?;
    if arguments.print_secrets {
        return say_json(&parts);
    }
    let script = script(arguments)?;
    let hand = HandPlan {
        sensors,
        scene: arguments.scene.scene(None)?,
        objects: arguments.objects.iter().map(|name| anchored(name)).collect(),
        seed: arguments.seed,
        grasp_every_s: Some(arguments.grasp_every).filter(|every| *every > 0.0),
        script,
    };
    let gripper = EmulatedGripper::new(EmulatorSetup {
        hand,
        parts,
        rate_hz: arguments.rate,
        channels: arguments.channels.map_or(sensors.len(), usize::from),
        most_steps: (arguments.max_bar * 20.0).round() as u8,
        clock_start_us: arguments.clock_start,
        faults: arguments.faults.0.clone(),
        seed: arguments.seed,
    })?;
    emulate(arguments, gripper)
}

/// Reads or draws the hidden parts, without the imperfections to leave out.
fn parts(arguments: &EmulateArguments) -> Result<HiddenParts, Failure> {
    let mut parts = match &arguments.secrets {
        None => HiddenParts::drawn(arguments.seed),
        Some(path) => {
            let wrong = |why: String| {
                format!("{}: {why}. `palpate emulate --print-secrets` prints a valid file", path.display())
            };
            let text = read_text(path, LARGEST_FILE).map_err(|e| wrong(e.to_string()))?;
            let parts: HiddenParts = serde_json::from_str(&text).map_err(|e| wrong(e.to_string()))?;
            parts.check().map_err(|error| wrong(error.to_string()))?;
            parts
        }
    };
    for left_out in &arguments.without {
        match left_out {
            Imperfection::Noise => parts.noise_counts = 0.0,
            Imperfection::Hysteresis => parts.hysteresis = false,
            Imperfection::Drift => parts.drift = false,
        }
    }
    Ok(parts)
}

/// Largest file of a script or of hidden parts (bytes).
const LARGEST_FILE: u64 = 1 << 20;

/// Reads the script from the argument or from the file it names.
fn script(arguments: &EmulateArguments) -> Result<Vec<Step>, Failure> {
    let Some(given) = arguments.script.as_deref().filter(|script| *script != "-") else { return Ok(Vec::new()) };
    let path = std::path::Path::new(given);
    let text = if path.is_file() { read_text(path, LARGEST_FILE)? } else { given.to_owned() };
    steps(&text)
}

/// Steps of a text, with objects by their full paths.
fn steps(text: &str) -> Result<Vec<Step>, Failure> {
    let mut steps = parse_script(text)?;
    for step in &mut steps {
        if let Step::Grasp { object, .. } = step {
            *object = anchored(object);
        }
    }
    Ok(steps)
}

#[cfg(not(unix))]
fn emulate(_arguments: &EmulateArguments, _gripper: EmulatedGripper) -> Result<(), Failure> {
    Err("emulate needs a pseudo-terminal: run it on Linux or macOS".into())
}

#[cfg(unix)]
fn emulate(arguments: &EmulateArguments, mut gripper: EmulatedGripper) -> Result<(), Failure> {
    use std::io::Write as _;

    let Some(link) = arguments.link.clone() else { return Err("name the link: --link FILE".into()) };
    let stop = stop_flag()?;
    let typed = (arguments.script.as_deref() == Some("-")).then(typed_lines).transpose()?;
    let begun = |path: &std::path::PathBuf| {
        let file = palpate_store::NewFile::create(path, FileKind::BoardLines).and_then(palpate_store::NewFile::appear);
        file.map_err(|cause| super::output::cannot(path, &cause))
    };
    let mut sent = arguments.sent.as_ref().map(begun).transpose()?;
    let mut greeting = (!arguments.json).then(|| {
        let link = link.display();
        format!("emulated gripper at {link} until Ctrl+C; try: palpate doctor {link}")
    });
    let served = PortSetup { link, speed: arguments.speed, baud: arguments.baud, boot_s: arguments.boot };
    let mut failure: Option<Failure> = None;
    serve(&mut gripper, &served, &stop, &mut |gripper| {
        let mut turn = || -> Result<(), Failure> {
            // The link exists by now.
            if let Some(greeting) = greeting.take() {
                say(greeting)?;
            }
            for happened in gripper.take_happened() {
                print_event(&happened, arguments.json)?;
            }
            let printed = gripper.take_printed();
            if let Some(file) = &mut sent {
                file.write_all(printed.as_bytes())?;
            }
            while let Some(line) = typed.as_ref().and_then(|lines| lines.try_recv().ok()) {
                // A line with an error adds none.
                match steps(&line) {
                    Ok(steps) => steps.into_iter().try_for_each(|step| gripper.add_step(step))?,
                    Err(error) => warn(&error.to_string()),
                }
            }
            Ok(())
        };
        if let Err(error) = turn() {
            failure = Some(error);
            stop.store(true, Ordering::Relaxed);
        }
    })?;
    failure.map_or(Ok(()), Err)
}

/// Prints an event.
#[cfg(unix)]
fn print_event(happened: &EmulatorEvent, json: bool) -> Result<(), Failure> {
    if json {
        return say(serde_json::to_string(happened)?);
    }
    let what = match &happened.what {
        EmulatorEventKind::Grasp { number, object } => format!("grasp {number}: {object}"),
        EmulatorEventKind::Hold { bend_deg: [left, right], load_n, seconds } => {
            format!("holds {left:.0} and {right:.0} degrees, {:.2} and {:.2} N, for {seconds} s", load_n[0], load_n[1])
        }
        EmulatorEventKind::ScriptDone => "end of the script".to_owned(),
        EmulatorEventKind::Fault { fault } => format!("fault {fault}"),
        EmulatorEventKind::Watchdog => "watchdog: the host is silent, the board vents".to_owned(),
        EmulatorEventKind::Failed { reason } => format!("simulation failed, the fingers do not move: {reason}"),
        EmulatorEventKind::HostCame => "host opened the port".to_owned(),
        EmulatorEventKind::HostLeft => "host closed the port".to_owned(),
        EmulatorEventKind::Port { path } => format!("port {path}"),
        EmulatorEventKind::Overrun { bytes } => format!("{bytes} bytes dropped: the host does not read"),
    };
    say(format!("{:>9.3} s  {what}", happened.t_s))
}
