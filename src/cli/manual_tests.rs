//! The commands that README, manual and `--help` print, read by the program's own parser.

use super::Arguments;
use crate::manual::TOPICS;
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};
use palpate_sim::objects::catalogue;
use palpate_tactile::{SensorLayout, SignalDefinition};

const README: &str = include_str!("../../README.md");

/// Words of a command as a shell splits them, up to a remark, a pipe or a redirection.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    for letter in line.chars() {
        match (quote, letter) {
            (None, '#' | '|' | '>' | ';') if word.is_none() => break,
            (None, '\'' | '"') => (quote, word) = (Some(letter), Some(word.unwrap_or_default())),
            (Some(open), _) if open == letter => quote = None,
            (None, ' ') => words.extend(word.take()),
            _ => word.get_or_insert_default().push(letter),
        }
    }
    words.extend(word);
    words
}

/// Lines of the code blocks of a text, and the code within its sentences.
fn code(text: &str) -> (Vec<String>, Vec<String>) {
    let (mut lines, mut prose, mut fenced) = (Vec::new(), String::new(), false);
    for line in text.lines() {
        match line.starts_with("```") {
            true => fenced = !fenced,
            false if fenced || line.starts_with("    ") => lines.push(line.trim().to_owned()),
            false => prose.extend([line, " "]),
        }
    }
    (lines, prose.split('`').skip(1).step_by(2).map(str::to_owned).collect())
}

/// Examples of all commands below one.
fn examples(command: &clap::Command) -> Vec<String> {
    let own = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let lines = own.lines().filter_map(|line| line.strip_prefix("  ")).map(str::to_owned);
    lines.chain(command.get_subcommands().flat_map(examples)).collect()
}

/// Why a command would be refused before it does anything; none of a part of one that a sentence names may be missing.
fn fault(line: &str, whole: bool) -> Option<String> {
    let words = words(line);
    let option = |name: &str| words.iter().skip_while(|word| *word != name).nth(1);
    if let Some(layout) = option("--layout").filter(|layout| *layout != "gripper") {
        let signals = option("--signals").map_or("parts", String::as_str);
        let signals = SignalDefinition::ALL.into_iter().find(|own| own.name() == signals)?;
        if let Err(error) = SensorLayout::learnt(layout, signals) {
            return Some(error.to_string());
        }
    }
    // The values of a shell's variables are not known.
    if words.first().is_none_or(|word| word != "palpate") || line.contains('$') {
        return None;
    }
    match Arguments::try_parse_from(&words) {
        Err(error) if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => None,
        Err(error) => {
            let wrong = [ErrorKind::UnknownArgument, ErrorKind::InvalidSubcommand, ErrorKind::ArgumentConflict];
            (whole || wrong.contains(&error.kind())).then(|| error.to_string())
        }
        // A misspelt command is taken for an object.
        Ok(Arguments { command: None, object: Some(object), .. }) if whole => {
            let known = object.contains('.') || catalogue().iter().any(|built_in| built_in.name == object);
            (!known).then(|| format!("there is no command or object {object}"))
        }
        Ok(_) => None,
    }
}

#[test]
fn every_printed_command_is_one_that_the_program_takes() {
    let examples = examples(&Arguments::command());
    assert!(examples.len() > 60, "{examples:?}");
    let texts = TOPICS.iter().map(|topic| (topic.name, topic.text)).chain([("README", README)]);
    let mut faults: Vec<String> = Vec::new();
    let mut read = 0;
    let mut check = |place: &str, line: &str, whole: bool| {
        read += usize::from(line.starts_with("palpate "));
        faults.extend(fault(line, whole).map(|fault| format!("{place}: {line}\n{fault}")));
    };
    examples.iter().for_each(|line| check("--help", line, true));
    for (place, text) in texts {
        let (lines, spans) = code(text);
        lines.iter().for_each(|line| check(place, line, true));
        spans.iter().for_each(|span| check(place, span, false));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(read > 300, "only {read} commands were found");
}

#[test]
fn wrong_commands_are_noticed() {
    for line in [
        "palpate demo mug.urdf --model taught.safetensors",
        "palpate grasp box --layout C6+F",
        "--layout C1+F",
        "palpate lsit",
        "palpate trials list --sicne today | less",
    ] {
        assert!(fault(line, line == "palpate lsit").is_some(), "{line}");
    }
    assert_eq!(words("palpate x --time '1 [s]' \"a b\"c # why"), ["palpate", "x", "--time", "1 [s]", "a bc"]);
}

#[test]
fn the_lines_about_the_real_gripper_follow_each_other() {
    let lines: Vec<&str> =
        README.lines().skip_while(|line| *line != "## With the real gripper").skip(1).take(12).collect();
    let commands: Vec<&&str> = lines.iter().filter(|line| line.starts_with("    palpate ")).collect();
    assert!(commands.len() > 5 && commands.iter().all(|line| line.contains(" /tmp/gripper")), "{commands:#?}");
}
