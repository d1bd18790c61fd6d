//! MCAP files as trials: those of this program bit by bit, those of others as channels over time.

use super::container::Pairs;
use super::messages::{MessageKind, read_numbers};
use super::reader::{ContainerFault, Record, read_records};
use super::{CHANNELS, TRIAL};
use crate::csv_files::read_csv;
use crate::format::{Import, ImportError, file_name};
use palpate_sim::objects::catalogue;
use palpate_store::ImportedTrial;
use palpate_tactile::Signals;
use std::collections::BTreeMap;
use std::io::{BufReader, Read};
use std::path::Path;

/// Most channels, and most numbers in all.
const MOST_CHANNELS: usize = 200;
const MOST_NUMBERS: usize = 50_000_000;
/// Most trials of a file.
const MOST_TRIALS: usize = 100_000;
/// Longest name of a channel or label (characters).
const LONGEST_NAME: usize = 200;

/// Reads the trials of an MCAP file. A file of another program is one trial with this label.
pub(super) fn read_mcap(path: &Path, label: &str) -> Result<Import, ImportError> {
    let file = palpate_geometry::open_regular(path).map_err(|cause| ImportError::of(path, cause))?;
    read_bag(BufReader::new(file), &file_name(path), label)
}

/// Reads the trials of an MCAP file from any source.
fn read_bag(source: impl Read, name: &str, label: &str) -> Result<Import, ImportError> {
    let mut bag = Bag::new(name);
    let whole = read_records(source, |record| bag.take(record));
    let whole = whole.map_err(|fault: String| ImportError::new(name, fault))?;
    let mut import = if bag.own.is_empty() || bag.rows.is_empty() {
        bag.foreign(label)?
    } else {
        Import { trials: bag.trials()?, warnings: bag.warnings() }
    };
    if !whole {
        import.warnings.push("the file is cut short; everything before its end was read".to_owned());
    }
    Ok(import)
}

impl From<ContainerFault> for String {
    fn from(fault: ContainerFault) -> Self {
        fault.to_string()
    }
}

fn too_large(most: usize, what: &str) -> String {
    format!("it has more than {most} {what}; split it")
}

/// A channel of the container.
struct Topic {
    name: String,
    kind: Option<MessageKind>,
    /// Names of all channels, in a file of this program.
    names: Option<Vec<String>>,
}

/// What has been read.
struct Bag<'a> {
    file: &'a str,
    schemas: BTreeMap<u16, String>,
    topics: BTreeMap<u16, Topic>,
    /// Metadata of trials of this program.
    own: Vec<Pairs>,
    /// Rows of all channels of this program: channel of the container, time (ns), values.
    rows: Vec<(u16, u64, Vec<f64>)>,
    /// Numbers over time by name, as any program writes them: time (ns) and value.
    numbers: BTreeMap<String, Vec<(u64, f64)>>,
    held: usize,
    unread: usize,
}

impl<'a> Bag<'a> {
    fn new(file: &'a str) -> Self {
        Self {
            file,
            schemas: BTreeMap::new(),
            topics: BTreeMap::new(),
            own: Vec::new(),
            rows: Vec::new(),
            numbers: BTreeMap::new(),
            held: 0,
            unread: 0,
        }
    }

    fn take(&mut self, record: Record<'_>) -> Result<(), String> {
        match record {
            Record::Schema { id, name, encoding } => {
                let name = if encoding == "ros2msg" || encoding == "ros2idl" { name } else { "" };
                self.schemas.insert(id, name.chars().take(LONGEST_NAME).collect());
            }
            Record::Channel { id, schema, topic, encoding, metadata } => {
                let schema = self.schemas.get(&schema).filter(|_| encoding == "cdr");
                let kind = schema.and_then(|name| MessageKind::named(name));
                let names = metadata.get("names").filter(|_| topic == CHANNELS);
                let names = names.and_then(|names| serde_json::from_str(names).ok());
                self.topics.insert(id, Topic { name: clean(topic), kind, names });
            }
            Record::Metadata { name: TRIAL, pairs } => {
                if self.own.len() >= MOST_TRIALS {
                    return Err(too_large(MOST_TRIALS, "trials"));
                }
                self.own.push(pairs);
            }
            Record::Metadata { .. } => {}
            Record::Message { channel, ns, data } => return self.message(channel, ns, data),
        }
        Ok(())
    }

    fn message(&mut self, channel: u16, ns: u64, data: &[u8]) -> Result<(), String> {
        let Some(topic) = self.topics.get(&channel) else { return Ok(()) };
        let Some(kind) = topic.kind else { return Ok(()) };
        if kind == MessageKind::Text || kind == MessageKind::Transforms {
            return Ok(());
        }
        let Some(values) = read_numbers(kind, data) else {
            self.unread += 1;
            return Ok(());
        };
        self.held += values.len();
        if self.held > MOST_NUMBERS {
            return Err(too_large(MOST_NUMBERS, "numbers"));
        }
        if topic.names.is_some() {
            self.rows.push((channel, ns, values.into_iter().map(|(_, value)| value).collect()));
            return Ok(());
        }
        for (end, value) in values {
            let name = format!("{}{}", topic.name, clean(&end));
            if !self.numbers.contains_key(&name) && self.numbers.len() >= MOST_CHANNELS {
                return Err(too_large(MOST_CHANNELS, "channels"));
            }
            self.numbers.entry(name).or_default().push((ns, value));
        }
        Ok(())
    }

    fn warnings(&self) -> Vec<String> {
        let unread =
            (self.unread > 0).then(|| format!("{} messages do not fit their type and were left out", self.unread));
        unread.into_iter().collect()
    }

    /// Trials of this program, by their descriptions.
    fn trials(&mut self) -> Result<Vec<ImportedTrial>, ImportError> {
        self.rows.sort_by_key(|(_, ns, _)| *ns);
        self.own.iter().map(|pairs| self.trial(pairs)).collect()
    }

    fn trial(&self, pairs: &Pairs) -> Result<ImportedTrial, ImportError> {
        let field = |name: &str| pairs.get(name).map(String::as_str).unwrap_or_default();
        let id: String = field("trial").chars().take(20).collect();
        let problem = |problem: &str| ImportError::new(self.file, format!("trial {id} {problem}"));
        let [begin, end] = ["begin_ns", "end_ns"].map(|name| field(name).parse::<u64>().ok());
        let (Some(begin), Some(end)) = (begin, end) else { return Err(problem("has no times")) };
        let [first, after] = [begin, end.saturating_add(1)].map(|ns| self.rows.partition_point(|row| row.1 < ns));
        let rows = self.rows.get(first..after).unwrap_or_default();
        let Some((channel, _, _)) = rows.first() else { return Err(problem("has no samples")) };
        let names = self.topics.get(channel).and_then(|topic| topic.names.as_ref());
        let Some(names) = names.filter(|names| names.len() > 1 && names.len() <= MOST_CHANNELS) else {
            return Err(problem("has no channels"));
        };
        if rows.iter().any(|(own, _, values)| own != channel || values.len() != names.len()) {
            return Err(problem("has rows of different lengths"));
        }
        let t_s: Vec<f64> = rows.iter().map(|(_, _, values)| values[0]).collect();
        if t_s.len() < 2 || !t_s.iter().all(|t| t.is_finite()) || !t_s.is_sorted_by(|a, b| a < b) {
            return Err(problem("has times that do not rise"));
        }
        let column = |place: usize| rows.iter().map(|(_, _, values)| values[place] as f32).collect::<Vec<f32>>();
        let columns: Vec<(String, Vec<f32>)> = names
            .iter()
            .enumerate()
            .skip(1)
            .filter_map(|(place, name)| Some((clean(name), filled(name, column(place))?)))
            .collect();
        if columns.is_empty() {
            return Err(problem("has no numbers"));
        }
        let mut signals =
            Signals { channels: columns.iter().map(|(name, _)| name.clone()).collect(), ..Signals::default() };
        for (k, t) in t_s.iter().enumerate() {
            signals.push(*t, &columns.iter().map(|(_, values)| values[k]).collect::<Vec<f32>>());
        }
        let label: String = field("object").chars().filter(|c| !c.is_control()).take(LONGEST_NAME).collect();
        let class = catalogue().iter().find(|built_in| built_in.name == label).map(|built_in| built_in.class());
        let (size, shape) = (class.as_ref().map(|c| c.size.name()), class.as_ref().map(|c| c.shape.name()));
        Ok(ImportedTrial { name: id, label, size: size.map(str::to_owned), shape: shape.map(str::to_owned), signals })
    }

    /// One trial of another program: the channel with most samples gives the times, the others are interpolated.
    fn foreign(&self, label: &str) -> Result<Import, ImportError> {
        let clock = self.numbers.values().max_by_key(|samples| samples.len()).filter(|samples| samples.len() > 1);
        let Some(clock) = clock else {
            let topic = |topic: &Topic| match topic.kind {
                Some(kind) => format!("{} ({})", topic.name, kind.name()),
                None => format!("{} (another type)", topic.name),
            };
            let mut topics: Vec<String> = self.topics.values().take(20).map(topic).collect();
            if topics.is_empty() {
                topics.push("no topics".to_owned());
            }
            let topics = topics.join(", ");
            let fault = format!(
                "it has no channel that can be imported; JointState, FluidPressure, Float32, Float64 and their arrays in \
                 CDR can be. It has: {topics}"
            );
            return Err(ImportError::new(self.file, fault));
        };
        let mut times: Vec<u64> = clock.iter().map(|(ns, _)| *ns).collect();
        times.sort_unstable();
        times.dedup();
        if times.len().saturating_mul(self.numbers.len()) > MOST_NUMBERS {
            return Err(ImportError::new(self.file, too_large(MOST_NUMBERS, "numbers")));
        }
        let origin = times.first().copied().unwrap_or(0);
        let columns: Vec<Vec<f64>> = self.numbers.values().map(|samples| at_times(samples, &times)).collect();
        let mut csv = String::from("trial,label,t_s");
        for name in self.numbers.keys() {
            csv.push(',');
            csv.push_str(name);
        }
        let label = clean(label);
        let mut rows = 0;
        let lines = times.iter().map(|ns| {
            let mut line = format!("\n1,{label},{}", (ns - origin) as f64 * 1e-9);
            for column in &columns {
                line.push(',');
                let value = column[rows];
                if value.is_finite() {
                    line.push_str(&(value as f32).to_string());
                }
            }
            rows += 1;
            line.into_bytes()
        });
        let text = Lines { rest: csv.into_bytes(), at: 0, lines };
        let mut import = read_csv(text, self.file)?;
        let mut warnings = self.warnings();
        let others = self.topics.values().filter(|topic| topic.kind.is_none()).count();
        if others > 0 {
            warnings.push(format!("{others} topics of other types were left out"));
        }
        warnings.append(&mut import.warnings);
        Ok(Import { trials: import.trials, warnings })
    }
}

/// Values of a column without gaps; none without any number. A pressure that is undefined is none, as recognisers take it;
/// other gaps keep the value before them.
fn filled(name: &str, mut values: Vec<f32>) -> Option<Vec<f32>> {
    let first = *values.iter().find(|value| value.is_finite())?;
    let mut last = if name.starts_with("pressure") { 0.0 } else { first };
    for value in &mut values {
        if !value.is_finite() {
            *value = last;
        } else if !name.starts_with("pressure") {
            last = *value;
        }
    }
    Some(values)
}

/// Samples at other times, on straight lines between them; before the first and after the last as these.
fn at_times(samples: &[(u64, f64)], times: &[u64]) -> Vec<f64> {
    let mut sorted: Vec<(u64, f64)> = samples.iter().copied().filter(|(_, value)| value.is_finite()).collect();
    sorted.sort_by_key(|(ns, _)| *ns);
    let value = |ns: &u64| {
        let after = sorted.partition_point(|(own, _)| own <= ns);
        match (after.checked_sub(1).and_then(|before| sorted.get(before)), sorted.get(after)) {
            (Some((t0, v0)), Some((t1, v1))) if ns != t0 => v0 + (v1 - v0) * ((ns - t0) as f64 / (t1 - t0) as f64),
            (Some((_, value)), _) | (None, Some((_, value))) => *value,
            (None, None) => f64::NAN,
        }
    };
    times.iter().map(value).collect()
}

/// A name that stands in one field of a table: no separators, brackets and control characters, not too long.
fn clean(text: &str) -> String {
    let bad = |c: char| c.is_control() || ",;\"()[]".contains(c);
    text.trim_start_matches('/').chars().map(|c| if bad(c) { '_' } else { c }).take(LONGEST_NAME / 2).collect()
}

/// Text that is made line by line as it is read.
struct Lines<I> {
    rest: Vec<u8>,
    at: usize,
    lines: I,
}

impl<I: Iterator<Item = Vec<u8>>> Read for Lines<I> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.at == self.rest.len() {
            let Some(next) = self.lines.next() else { return Ok(0) };
            (self.rest, self.at) = (next, 0);
        }
        let count = buffer.len().min(self.rest.len() - self.at);
        buffer[..count].copy_from_slice(&self.rest[self.at..self.at + count]);
        self.at += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::super::container::McapWriter;
    use super::super::messages;
    use super::*;
    use proptest::prelude::*;

    /// A file of another program: two topics at different rates, and one that cannot be read.
    fn foreign() -> Vec<u8> {
        let mut out = McapWriter::new(Vec::new(), "another program").expect("writes");
        let mut channel = |kind: MessageKind, topic: &str| {
            let schema = out.schema(kind.name(), &kind.definition());
            out.channel(schema, topic, &Pairs::new())
        };
        let joints = channel(MessageKind::JointState, "/arm/joints");
        let grip = channel(MessageKind::Number, "/grip [N]");
        let word = channel(MessageKind::Text, "/word");
        let names = ["a,b".to_owned(), "c".to_owned()];
        for n in 0..100u64 {
            let ns = 1_700_000_000_000_000_000 + n * 10_000_000;
            let state = messages::joint_state(ns, &names, &[n as f64, 0.5]);
            out.message(joints, ns, &state).expect("writes");
            if n % 10 == 0 {
                let mut number = vec![0, 1, 0, 0];
                number.extend((2.0 * n as f64).to_le_bytes());
                out.message(grip, ns, &number).expect("writes");
            }
        }
        out.message(word, 1_700_000_000_000_000_000, &messages::text("hello")).expect("writes");
        out.finish().expect("writes")
    }

    #[test]
    fn topics_of_other_programs_become_channels() {
        let import = read_bag(&foreign()[..], "bag.mcap", "mug").expect("reads");
        assert_eq!(import.trials.len(), 1);
        let trial = &import.trials[0];
        assert_eq!((trial.label.as_str(), trial.signals.len()), ("mug", 100));
        assert_eq!(trial.signals.channels, ["arm/joints_a_b", "arm/joints_c", "grip _N_"]);
        // The slower topic lies on straight lines between its samples.
        assert_eq!(trial.signals.row(15), [15.0, 0.5, 30.0]);
        assert!((trial.signals.t_s[15] - 0.15).abs() < 1e-9);
    }

    #[test]
    fn files_without_numbers_say_what_they_have() {
        let mut out = McapWriter::new(Vec::new(), "x").expect("writes");
        let schema = out.schema("sensor_msgs/msg/Image", "uint32 height\n");
        out.channel(schema, "/camera", &Pairs::new());
        let error = read_bag(&out.finish().expect("writes")[..], "a.mcap", "mug").expect_err("refused").to_string();
        assert!(error.contains("JointState") && error.contains("camera (another type)"), "{error}");
        let cut = &foreign()[..40];
        assert!(read_bag(cut, "a.mcap", "mug").expect_err("refused").to_string().contains("no topics"));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// Changed and cut files end with trials or an error, never with a panic.
        #[test]
        fn damaged_files_end_in_order(
            places in proptest::collection::vec((0usize..100_000, any::<u8>()), 0..6),
            cut in 0usize..100_000,
        ) {
            let mut bytes = foreign();
            let length = bytes.len();
            for (place, value) in places {
                bytes[place % length] = value;
            }
            bytes.truncate(length - cut % (length / 4));
            if let Ok(import) = read_bag(&bytes[..], "a.mcap", "mug") {
                for trial in &import.trials {
                    prop_assert!(trial.signals.values.iter().all(|value| value.is_finite()));
                    prop_assert!(trial.signals.t_s.is_sorted_by(|a, b| a < b));
                }
            }
        }

        /// Any messages of the right type, however malformed, are left out or read.
        #[test]
        fn any_messages_end_in_order(messages in proptest::collection::vec(any::<Vec<u8>>(), 0..20), kind in 0usize..8) {
            let kinds = ["sensor_msgs/msg/JointState", "std_msgs/msg/Float64MultiArray", "std_msgs/msg/Float32",
                "sensor_msgs/msg/FluidPressure", "std_msgs/msg/Float64", "std_msgs/msg/Float32MultiArray",
                "std_msgs/msg/String", "tf2_msgs/msg/TFMessage"];
            let mut out = McapWriter::new(Vec::new(), "x").expect("writes");
            let schema = out.schema(kinds[kind], "");
            let channel = out.channel(schema, "/a", &Pairs::new());
            for (n, message) in messages.iter().enumerate() {
                let message: Vec<u8> = [0, 1, 0, 0].into_iter().chain(message.iter().copied()).collect();
                out.message(channel, n as u64 * 1_000_000, &message).expect("writes");
            }
            let _outcome = read_bag(&out.finish().expect("writes")[..], "a.mcap", "mug");
        }
    }
}
