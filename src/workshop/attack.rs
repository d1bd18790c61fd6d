//! Attacks on the store: programs killed at random moments, several writers at once, bits that flip, a disk that is full.
//! Nothing that was recorded may be lost or changed without a word.

use super::{Failure, report};
use palpate_store::Store;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Commands that are killed, each with the number of trials before it and after it.
const KILLED: [(&str, i64, i64); 5] = [
    ("trials import MANY", 4, 604),
    ("trials merge OTHER", 4, 34),
    ("trials delete 1-4", 4, 0),
    ("trials purge", 4, 4),
    ("collect --objects empty --trials 60", 4, 64),
];

/// Runs the attacks so many times each with the program.
pub(crate) fn run(program: &Path, rounds: u32, full: Option<&Path>) -> Result<(), Failure> {
    let program = std::path::absolute(program)?;
    let folder = tempfile::tempdir()?;
    let ground = Ground::new(&program, folder.path())?;
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for (command, before, after) in KILLED {
        let mut counts = [0; 3];
        for round in 0..rounds {
            let store = ground.copy(&format!("killed{round}"))?;
            let mut child = ground.command(command, &store).spawn()?;
            std::thread::sleep(Duration::from_millis(random.random_range(2..150)));
            // It may have ended by itself.
            let _killed = child.kill();
            child.wait()?;
            let kept = sound_trials(&store)?;
            let all_or_nothing = kept == before || kept == after || command.starts_with("collect");
            if !all_or_nothing || kept < before.min(after) {
                return Err(format!("`{command}` was killed: {kept} trials, not {before} or {after}").into());
            }
            counts[if kept == before {
                0
            } else if kept == after {
                1
            } else {
                2
            }] += 1;
            // The same command ends the work.
            let ended = ground.command(command, &store).status()?;
            if !ended.success() && !command.starts_with("trials delete") || sound_trials(&store)? != after {
                return Err(format!("`{command}` does not end after a kill").into());
            }
        }
        report(format_args!(
            "{command}: killed {rounds} times: {} nothing, {} all, {} whole trials",
            counts[0], counts[1], counts[2]
        ));
    }
    writers(&ground)?;
    flips(&ground, rounds * 4, &mut random)?;
    if let Some(full) = full {
        full_disk(&ground, full)?;
    }
    Ok(())
}

/// A store with four trials, another with thirty, and a table of six hundred.
struct Ground {
    program: PathBuf,
    folder: PathBuf,
}

impl Ground {
    fn new(program: &Path, folder: &Path) -> Result<Self, Failure> {
        let ground = Self { program: program.to_owned(), folder: folder.to_owned() };
        let rows = (0..600).flat_map(|k| (0..20).map(move |n| format!("{k},mug,{},{}\n", 0.02 * f64::from(n), n + k)));
        let table: String = std::iter::once("trial,label,t_s,grip\n".to_owned()).chain(rows).collect();
        std::fs::write(folder.join("many.csv"), table)?;
        for (name, seed, trials) in [("own.sqlite", 1, 4), ("other.sqlite", 7, 30)] {
            let command = format!("collect --objects ball --trials {trials} --seed {seed}");
            let made = ground.command(&command, &folder.join(name)).status()?;
            if !made.success() {
                return Err(format!("`{command}` fails").into());
            }
        }
        Ok(ground)
    }

    fn copy(&self, name: &str) -> Result<PathBuf, Failure> {
        let store = self.folder.join(format!("{name}.sqlite"));
        for beside in ["", "-wal", "-shm"] {
            // Most stores have nothing beside them.
            let _removed = std::fs::remove_file(self.folder.join(format!("{name}.sqlite{beside}")));
        }
        std::fs::copy(self.folder.join("own.sqlite"), &store)?;
        Ok(store)
    }

    fn command(&self, command: &str, store: &Path) -> Command {
        let words = command.split(' ').map(|word| match word {
            "MANY" => self.folder.join("many.csv").into_os_string(),
            "OTHER" => self.folder.join("other.sqlite").into_os_string(),
            word => word.into(),
        });
        let mut run = Command::new(&self.program);
        run.args(words).arg("--store").arg(store).stdout(Stdio::null()).stderr(Stdio::null());
        run.env("XDG_DATA_HOME", self.folder.join("data"));
        run
    }
}

/// Number of trials that are kept; an error where one of them is damaged.
fn sound_trials(path: &Path) -> Result<i64, Failure> {
    let store = Store::open(path)?;
    let rows = store.list(false)?;
    for row in rows.iter().filter(|row| row.state == "complete") {
        store.load(row.id)?;
    }
    Ok(rows.iter().filter(|row| row.state == "complete").count() as i64)
}

/// Eight programs write into one store at once.
fn writers(ground: &Ground) -> Result<(), Failure> {
    let store = ground.copy("writers")?;
    let commands = (1..=8).map(|k| format!("grasp cylinder --seed {k}"));
    let mut children =
        commands.map(|command| ground.command(&command, &store).spawn()).collect::<Result<Vec<_>, _>>()?;
    for child in &mut children {
        if !child.wait()?.success() {
            return Err("one of eight writers fails".into());
        }
    }
    let kept = sound_trials(&store)?;
    report(format_args!("eight writers at once: {kept} of 12 trials"));
    if kept == 12 { Ok(()) } else { Err("a trial of eight writers is lost".into()) }
}

/// One bit of a store flips: its trials are the same, or the damage is said.
fn flips(ground: &Ground, rounds: u32, random: &mut ChaCha8Rng) -> Result<(), Failure> {
    let sound = std::fs::read(ground.folder.join("own.sqlite"))?;
    let contents = |path: &Path| -> Result<Vec<String>, Failure> {
        let store = Store::open_to_read(path)?;
        let ids = store.list(false)?.into_iter().map(|row| row.id);
        ids.map(|id| Ok(format!("{:?}", store.load(id)?))).collect()
    };
    let wanted = contents(&ground.copy("flipped")?)?;
    let mut counts = [0; 3];
    for _ in 0..rounds {
        let mut bytes = sound.clone();
        let at = random.random_range(0..bytes.len());
        bytes[at] ^= 1 << random.random_range(0..8);
        let store = ground.copy("flipped")?;
        std::fs::write(&store, bytes)?;
        counts[match contents(&store) {
            Ok(found) if found == wanted => 0,
            Err(_) => 1,
            Ok(_) => 2,
        }] += 1;
    }
    report(format_args!(
        "{rounds} flipped bits: {} without effect, {} found, {} unnoticed",
        counts[0], counts[1], counts[2]
    ));
    if counts[2] == 0 { Ok(()) } else { Err("a flipped bit changes trials without a word".into()) }
}

/// A disk becomes full while trials are collected: those before it are kept, and the command fails.
fn full_disk(ground: &Ground, folder: &Path) -> Result<(), Failure> {
    let store = folder.join("full.sqlite");
    std::fs::copy(ground.folder.join("own.sqlite"), &store)?;
    let ended = ground.command("collect --objects ball --trials 100000 --seed 3", &store).status()?;
    let kept = sound_trials(&store)?;
    report(format_args!("full disk: {kept} trials are kept, exit code {:?}", ended.code()));
    if ended.code() == Some(1) && kept >= 4 { Ok(()) } else { Err("a full disk loses trials, or is no failure".into()) }
}
