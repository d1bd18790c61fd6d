//! `palpate help`: the manual in the terminal, and the long help of a command.

mod page;

use super::Arguments;
use super::prelude::*;
use super::terminal::ESCAPES;
use crate::manual::TOPICS;
use clap::builder::PossibleValuesParser;
use clap::{CommandFactory, Parser};
use std::io::IsTerminal as _;

/// Arguments of `palpate help`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate help                   # list topics and commands
  palpate help scenes            # a topic
  palpate help trials label      # a command")]
pub(super) struct HelpArguments {
    /// Topic or command; without it, all of them are listed.
    #[arg(value_name = "TOPIC|COMMAND")]
    names: Vec<String>,
}

pub(super) fn run(arguments: &HelpArguments) -> Result<(), Failure> {
    let mut program = Arguments::command();
    program.build();
    let Some(name) = arguments.names.first() else { return say_as_is(contents(&program)) };
    match TOPICS.iter().find(|topic| topic.name == name) {
        Some(topic) => say_as_is(page::render(topic.text, terminal_width(), emphasis())),
        None => command_help(&program, &arguments.names),
    }
}

/// Prints what `palpate NAMES --help` prints.
fn command_help(program: &clap::Command, names: &[String]) -> Result<(), Failure> {
    let mut command = program;
    for (depth, name) in names.iter().enumerate() {
        match command.find_subcommand(name) {
            Some(found) => command = found,
            None => {
                let topics = TOPICS.iter().map(|topic| topic.name).filter(|_| depth == 0);
                let commands = command.get_subcommands().filter(|c| !c.is_hide_set()).map(clap::Command::get_name);
                refuse("palpate help", "TOPIC|COMMAND", name, topics.chain(commands));
            }
        }
    }
    let line = std::iter::once("palpate").chain(names.iter().map(String::as_str)).chain(["--help"]);
    Arguments::try_parse_from(line).map_or_else(|help| Ok(help.print()?), |_| Ok(()))
}

/// Ends the program as wrong use; clap adds the nearest of the known names.
pub(super) fn refuse<'a>(
    program: &'static str,
    argument: &'static str,
    name: &str,
    known: impl Iterator<Item = &'a str>,
) {
    // Leaked, because clap wants names that live as long as the program, which ends here.
    let known = PossibleValuesParser::new(known.map(|known| &*known.to_owned().leak()));
    let argument = clap::Arg::new(argument).value_parser(known);
    if let Err(error) = clap::Command::new(program).arg(argument).try_get_matches_from([program, name]) {
        error.exit();
    }
}

/// The lists of topics and commands.
fn contents(program: &clap::Command) -> String {
    let (width, bold) = (terminal_width(), emphasis());
    let commands = program.get_subcommands().filter(|command| !command.is_hide_set());
    let about = |command: &clap::Command| command.get_about().map(ToString::to_string).unwrap_or_default();
    let sections = [
        (
            "Usage",
            vec![
                ("palpate [OBJECT|FILE]", "open the window".to_owned()),
                ("palpate COMMAND ..", "run a command without a window".to_owned()),
                ("palpate help TOPIC|COMMAND", "print a topic, or the help of a command".to_owned()),
            ],
        ),
        ("Topics", TOPICS.iter().map(|topic| (topic.name, topic.summary().trim_end_matches('.').to_owned())).collect()),
        ("Commands", commands.map(|command| (command.get_name(), about(command))).collect()),
    ];
    let text: Vec<String> = sections.iter().map(|(title, rows)| page::definitions(title, rows, width, bold)).collect();
    text.join("\n\n")
}

/// True where headings are printed in bold.
fn emphasis() -> bool {
    ESCAPES && std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none()
}

/// Width to which clap wraps help: that of the terminal, at most 100.
fn terminal_width() -> usize {
    let help = clap::Command::new("width").about("x ".repeat(200)).help_template("{about}").render_help().to_string();
    help.lines().map(|line| line.len() + 1).max().unwrap_or(80).clamp(40, 100)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::error::ErrorKind;

    /// Commands in a text: lines that begin with `palpate`, up to a comment or a pipe.
    fn commands(text: &str) -> Vec<String> {
        let command = |line: &str| {
            let line = line.trim_start().strip_prefix("parallel ").unwrap_or(line.trim_start());
            let line = line.split(" #").next()?.split(" | ").next()?.split(" > ").next()?.split(" :::").next()?;
            (line == "palpate" || line.starts_with("palpate ")).then(|| line.trim().to_owned())
        };
        text.lines().filter_map(command).collect()
    }

    /// Lines of code blocks, fenced or indented.
    fn code(text: &str) -> String {
        let mut fenced = false;
        let mut lines = Vec::new();
        for line in text.lines() {
            if line.starts_with("```") {
                fenced = !fenced;
            } else if fenced || line.starts_with("    ") {
                lines.push(line);
            }
        }
        lines.join("\n")
    }

    /// Words of a command line; variables and placeholders of a shell stand for numbers.
    fn words(line: &str) -> Vec<String> {
        let mut words = vec![String::new()];
        let mut quote = None;
        for c in line.replace("{}", "1").replace("$SLURM_ARRAY_TASK_ID", "1").chars() {
            match quote {
                Some(open) if c == open => quote = None,
                None if c == '"' || c == '\'' => quote = Some(c),
                None if c == ' ' => words.push(String::new()),
                _ => words.last_mut().expect("has one").push(c),
            }
        }
        words.retain(|word| !word.is_empty());
        words
    }

    fn parses(line: &str) -> Result<(), String> {
        match Arguments::try_parse_from(words(line)) {
            Ok(arguments) => match &arguments.object {
                // A command that does not exist would be taken for an object.
                Some(object) if arguments.command.is_none() && !object.contains('.') => {
                    Err(format!("no command: {line}"))
                }
                _ => Ok(()),
            },
            Err(error) if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => Ok(()),
            Err(error) => Err(format!("{line}: {error}")),
        }
    }

    #[test]
    fn every_command_in_the_manual_and_in_examples_parses() {
        let readme = include_str!("../../README.md");
        let mut lines: Vec<String> = TOPICS.iter().flat_map(|topic| commands(&code(topic.text))).collect();
        lines.extend(commands(&code(readme)));
        assert!(lines.len() > 80, "only {} commands found", lines.len());
        let mut program = Arguments::command();
        program.build();
        let mut level: Vec<clap::Command> = program.get_subcommands().filter(|c| !c.is_hide_set()).cloned().collect();
        for command in &level {
            let help = command.clone().render_long_help().to_string();
            assert!(help.contains("Example"), "palpate {} has no examples", command.get_name());
        }
        while let Some(command) = level.pop() {
            let examples = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            lines.extend(commands(&examples));
            level.extend(command.get_subcommands().cloned());
        }
        for line in lines {
            parses(&line).unwrap_or_else(|error| panic!("{error}"));
        }
    }

    #[test]
    fn every_command_and_argument_is_described() {
        let mut level = vec![Arguments::command()];
        while let Some(command) = level.pop() {
            assert!(command.get_about().is_some(), "{} has no description", command.get_name());
            for argument in command.get_arguments() {
                assert!(argument.get_help().is_some(), "{} {} has none", command.get_name(), argument.get_id());
            }
            level.extend(command.get_subcommands().cloned());
        }
    }

    #[test]
    fn commands_in_running_text_exist() {
        let changelog = include_str!("../../CHANGELOG.md");
        let readme = include_str!("../../README.md");
        let mut program = Arguments::command();
        program.build();
        for text in TOPICS.iter().map(|topic| topic.text).chain([readme, changelog]) {
            for span in text.split('`').skip(1).step_by(2).filter(|span| span.starts_with("palpate ")) {
                let (mut command, mut after_flag) = (&program, false);
                for word in span.split_whitespace().skip(1) {
                    if let Some(flag) = word.strip_prefix("--") {
                        let known = command.get_arguments().any(|a| a.get_long() == Some(flag)) || flag == "help";
                        assert!(known, "{span}: no flag --{flag}");
                        after_flag = true;
                    } else if let Some(found) = command.find_subcommand(word) {
                        command = found;
                    } else if command.get_name() == "help" {
                        let topic = TOPICS.iter().any(|topic| topic.name == word);
                        assert!(topic || program.find_subcommand(word).is_some() || word == "TOPIC", "{span}");
                    } else {
                        let placeholder = word.chars().any(|c| c.is_uppercase() || c == '.');
                        let takes = command.get_positionals().next().is_some() && command.get_name() != "palpate";
                        assert!(placeholder || takes || after_flag, "{span}: no command {word}");
                    }
                }
            }
        }
    }

    #[test]
    fn topics_have_names_of_their_own_and_a_summary_of_one_line() {
        let program = Arguments::command();
        for topic in TOPICS {
            assert!(program.find_subcommand(topic.name).is_none(), "{} is a command too", topic.name);
            let summary = topic.summary();
            assert!(summary.ends_with('.') && summary.len() <= 96, "{}: {summary}", topic.name);
            assert_eq!(topic.text.lines().nth(1), Some(""), "{}", topic.name);
            let page = page::render(topic.text, 80, false);
            assert!(!page.contains("```") && !page.contains("**"), "{}", topic.name);
        }
        for topic in TOPICS {
            assert!(contents(&program).contains(topic.name));
        }
    }
}
