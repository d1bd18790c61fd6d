//! `palpate trials import`: trials of other programs.

use super::super::output::cannot;
use super::super::prelude::*;
use super::nothing_added;
use palpate_exchange::{Mapping, SPLIT_GAP_S, read_trials};
use palpate_store::write_whole;
use palpate_study::StudyCommand;

pub(super) const EXAMPLES: &str = "Examples:
  palpate trials import grasps.csv bag.mcap
  palpate trials import log.csv --profile plotjuggler --label mug
  palpate trials import log.csv --time 'timestamp [ms]' --label object --split-by gap
  palpate trials import glove.csv --time 1[s] --label mug --channel 'force_left=2 [kgf]'
  palpate trials import run.csv --time t --trial episode --save-profile lab.toml

A column is named as in the header, with or without a unit in brackets, which counts instead of the header's; in a table \
without a header by its number. See also: palpate help formats";

/// Arguments of `palpate trials import`.
#[derive(Debug, clap::Args)]
pub(super) struct ImportArguments {
    /// CSV, MCAP, NPZ or Parquet files. Optional columns for stage one: size (tiny, large), shape (cubic, cylindrical,
    /// spherical).
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    mapping: MappingArguments,
    /// Save the roles as a profile.
    #[arg(long, value_name = "FILE.toml", value_parser = file_of(&[Mapping::FILE]))]
    save_profile: Option<PathBuf>,
}

/// Roles of the columns of tables of other programs.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct MappingArguments {
    /// Column of the label, or the label of all trials (default: the column label, or else the name of the file).
    #[arg(long, value_name = "COLUMN|NAME")]
    label: Option<String>,
    /// Column of times, with its unit if the header has none: `timestamp [ms]` (default: t_s).
    #[arg(long, value_name = "COLUMN")]
    time: Option<String>,
    /// Column that tells trials apart (default: the column trial, or else one trial).
    #[arg(long, value_name = "COLUMN")]
    trial: Option<String>,
    /// Begin a new trial after a pause of a second, or of N seconds with gap=N, and where the time falls.
    #[arg(long, value_name = "gap[=N]", value_parser = split_by)]
    split_by: Option<f64>,
    /// Channel with the column that it is read from, as in `force_left=grip [kgf]`; may be repeated (default: all columns).
    #[arg(long, value_name = "NAME=COLUMN")]
    channel: Vec<String>,
    /// Subtract each channel's mean over the first 0.15 s of its trial: a live gripper's readings are less their rest, too.
    #[arg(long)]
    rezero: bool,
    /// Lines above the header.
    #[arg(long, value_name = "N")]
    skip: Option<u64>,
    /// Character between fields, or `tab` (default: the one that fits the header).
    #[arg(long, value_name = "CHARACTER", value_parser = delimiter)]
    delimiter: Option<char>,
    /// Roles of the columns in tables of a program: plotjuggler, serial-studio, edge-impulse, teleplot, lerobot, or a file that
    /// --save-profile wrote. Other options count before it.
    #[arg(long, value_name = "NAME|FILE.toml")]
    profile: Option<String>,
}

fn split_by(text: &str) -> Result<f64, String> {
    let wrong = || format!("\"{text}\" is neither gap nor gap=SECONDS");
    match text.strip_prefix("gap").ok_or_else(wrong)? {
        "" => Ok(SPLIT_GAP_S),
        seconds => {
            let seconds = seconds.strip_prefix('=').ok_or_else(wrong)?;
            seconds.trim_end_matches('s').trim().parse().map_err(|_no_number| wrong())
        }
    }
}

fn delimiter(text: &str) -> Result<char, String> {
    match (text, text.chars().next(), text.chars().count()) {
        ("tab" | "\\t", ..) => Ok('\t'),
        (_, Some(character), 1) => Ok(character),
        _ => Err("one character, or tab".to_owned()),
    }
}

impl MappingArguments {
    pub(in crate::cli) fn mapping(&self) -> Result<Mapping, String> {
        let profile = self.profile.as_deref().map(Mapping::profile).transpose()?.unwrap_or_default();
        let mapping = Mapping {
            skip: self.skip.unwrap_or(profile.skip),
            delimiter: self.delimiter.or(profile.delimiter),
            time: self.time.clone().or(profile.time),
            label: self.label.clone().or(profile.label),
            trial: self.trial.clone().or(profile.trial),
            split_gap_s: self.split_by.or(profile.split_gap_s),
            rezero: self.rezero || profile.rezero,
            channels: if self.channel.is_empty() { profile.channels } else { self.channel.clone() },
            ..profile
        };
        mapping.check()?;
        Ok(mapping)
    }

    /// The command with these options.
    pub(in crate::cli) fn repeated(&self, command: StudyCommand) -> StudyCommand {
        let quoted = |text: &Option<String>| text.as_ref().map(|text| format!("'{text}'"));
        let command = command
            .option("label", quoted(&self.label))
            .option("time", quoted(&self.time))
            .option("trial", quoted(&self.trial))
            .option("split-by", self.split_by.map(|seconds| format!("gap={seconds}")))
            .option("skip", self.skip)
            .flag("rezero", self.rezero)
            .option("delimiter", quoted(&self.delimiter.map(String::from)))
            .option("profile", quoted(&self.profile));
        self.channel.iter().fold(command, |command, channel| command.option("channel", Some(format!("'{channel}'"))))
    }
}

pub(super) fn run(arguments: &ImportArguments, store: &mut Store) -> Result<(), Failure> {
    let mapping = arguments.mapping.mapping()?;
    for file in &arguments.files {
        let Imported { collection, added, known } = import(file, &mapping, store)?;
        say(format!("{}: {added} trial(s) added as collection {collection}, {known} already there", file.display()))?;
    }
    if let Some(path) = &arguments.save_profile {
        let text = mapping.to_toml()?;
        write_whole(path, Mapping::FILE, text.as_bytes()).map_err(|cause| cannot(path, &cause))?;
        say(format!("profile saved as {}", path.display()))?;
    }
    Ok(())
}

/// What came of a file.
struct Imported {
    collection: String,
    added: u32,
    /// Trials that were there already.
    known: usize,
}

fn import(file: &Path, mapping: &Mapping, store: &mut Store) -> Result<Imported, Failure> {
    let import = read_trials(file, mapping)?;
    for warning in &import.warnings {
        warn(warning);
    }
    let collection = file.file_stem().map_or_else(|| "import".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let added = store.insert_imported(&collection, &import.trials).map_err(|error| nothing_added(file, &error))?;
    let known = import.trials.len() - added as usize;
    Ok(Imported { collection, added, known })
}

/// Adds the trials of files to a store, where they are not there already.
pub(in crate::cli) fn import_all(files: &[PathBuf], mapping: &Mapping, store: &mut Store) -> Result<(), Failure> {
    files.iter().try_for_each(|file| import(file, mapping, store).map(|_| ()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_and_delimiters_are_read() {
        assert_eq!((split_by("gap"), split_by("gap=0.3"), split_by("gap=2 s")), (Ok(1.0), Ok(0.3), Ok(2.0)));
        assert!(["", "gap2", "time", "gap=x"].iter().all(|text| split_by(text).is_err()));
        assert_eq!((delimiter("tab"), delimiter("|")), (Ok('\t'), Ok('|')));
        assert!(delimiter("||").is_err() && delimiter("").is_err());
    }
}
