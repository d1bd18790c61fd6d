//! MCAP files as trials: those of this program bit by bit, those of others as channels over time.

use super::container::Pairs;
use super::messages::{MessageKind, Numbers, read_numbers};
use super::reader::{ContainerFault, Record, read_records};
use super::{CHANNELS, TAXELS, TRIAL};
use crate::csv_files::read_made;
use crate::format::{Import, ImportError, file_name};
use crate::mapping::Mapping;
use crate::series::{MOST_CHANNELS, MOST_NUMBERS, Series};
use palpate_sim::objects::catalogue;
use palpate_store::ImportedTrial;
use palpate_tactile::{Signals, unit_of_channel};
use std::collections::BTreeMap;
use std::io::{BufReader, Read};
use std::path::Path;

/// Most trials of a file.
const MOST_TRIALS: usize = 100_000;
/// Longest name of a channel or label (characters).
const LONGEST_NAME: usize = 200;

/// Reads the trials of an MCAP file. A file of another program is one trial with this label.
pub(super) fn read_mcap(path: &Path, mapping: &Mapping) -> Result<Import, ImportError> {
    let file = palpate_geometry::open_regular(path).map_err(|cause| ImportError::of(path, cause))?;
    read_bag(BufReader::new(file), &file_name(path), mapping, &mapping.label_of(path))
}

/// Reads the trials of an MCAP file from any source.
fn read_bag(source: impl Read, name: &str, mapping: &Mapping, label: &str) -> Result<Import, ImportError> {
    let mut bag = Bag::new(name);
    let whole = read_records(source, |record| bag.take(record));
    let whole = whole.map_err(|fault: String| ImportError::new(name, fault))?;
    let mut import = if bag.own.is_empty() || bag.rows.is_empty() {
        bag.foreign(mapping, label)?
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
    /// Its schema and how its messages are written, where they cannot be read.
    type_name: String,
    kind: Option<MessageKind>,
    /// Names of all channels with the units that these do not tell, in a file of this program.
    names: Option<Vec<String>>,
}

impl Topic {
    fn described(&self) -> String {
        format!("{} ({})", self.name, self.type_name)
    }
}

/// A number of a message.
struct Reading {
    /// When it was logged, and the time in its header (ns).
    ns: u64,
    stamp_ns: Option<u64>,
    /// Stretch of the file in which times rise.
    segment: usize,
    value: f64,
}

/// What has been read.
struct Bag<'a> {
    file: &'a str,
    schemas: BTreeMap<u16, [String; 2]>,
    topics: BTreeMap<u16, Topic>,
    /// Metadata of trials of this program.
    own: Vec<Pairs>,
    /// Rows of all channels of this program: channel of the container, time (ns), values.
    rows: Vec<(u16, u64, Vec<f64>)>,
    /// Numbers by name, as any program writes them.
    numbers: BTreeMap<String, Vec<Reading>>,
    /// First and last time of each stretch in which times rise (ns).
    segments: Vec<[u64; 2]>,
    last_ns: u64,
    first_ns: u64,
    held: usize,
    unread: usize,
    /// Numbers that are infinite or none.
    undefined: usize,
    damaged_chunks: usize,
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
            segments: Vec::new(),
            last_ns: 0,
            first_ns: u64::MAX,
            held: 0,
            unread: 0,
            undefined: 0,
            damaged_chunks: 0,
        }
    }

    fn take(&mut self, record: Record<'_>) -> Result<(), String> {
        match record {
            Record::Schema { id, name, encoding } => {
                self.schemas.insert(id, [name, encoding].map(|text| text.chars().take(LONGEST_NAME).collect()));
            }
            Record::Channel { id, schema, topic, encoding, metadata } => {
                let schema = self.schemas.get(&schema);
                let is_ros = |written: &str| written == "ros2msg" || written == "ros2idl";
                let kind = schema.filter(|[_, written]| encoding == "cdr" && is_ros(written));
                // Forces on taxels are not channels.
                let kind = kind.filter(|_| topic != TAXELS).and_then(|[name, _]| MessageKind::named(name));
                let type_name = match schema {
                    Some([name, _]) if encoding == "cdr" => clean(name),
                    Some([name, _]) => format!("{} in the encoding {}", clean(name), clean(encoding)),
                    None => format!("the encoding {}", clean(encoding)),
                };
                let of_metadata = |key: &str| -> Option<Vec<String>> {
                    serde_json::from_str(metadata.get(key).filter(|_| topic == CHANNELS)?).ok()
                };
                let units = of_metadata("units").unwrap_or_default();
                let with_unit = |(k, name): (usize, String)| match units.get(k).filter(|unit| !unit.is_empty()) {
                    Some(unit) if unit_of_channel(&name).1.is_empty() && k > 0 => format!("{name} [{unit}]"),
                    _ => name,
                };
                let names = of_metadata("names").map(|names| names.into_iter().enumerate().map(with_unit).collect());
                self.topics.insert(id, Topic { name: clean(topic), type_name, kind, names });
            }
            Record::Metadata { name: TRIAL, pairs } => {
                if self.own.len() >= MOST_TRIALS {
                    return Err(too_large(MOST_TRIALS, "trials"));
                }
                self.own.push(pairs);
            }
            Record::Metadata { .. } => {}
            Record::Message { channel, ns, data } => return self.message(channel, ns, data),
            Record::DamagedChunk => self.damaged_chunks += 1,
        }
        Ok(())
    }

    fn message(&mut self, channel: u16, ns: u64, data: &[u8]) -> Result<(), String> {
        let Some(topic) = self.topics.get(&channel) else { return Ok(()) };
        let Some(kind) = topic.kind else { return Ok(()) };
        if matches!(kind, MessageKind::Text | MessageKind::Transforms | MessageKind::Markers) {
            return Ok(());
        }
        let Some(Numbers { stamp_ns, values }) = read_numbers(kind, data) else {
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
        if self.segments.is_empty() || ns.saturating_add(FALL_NS) < self.last_ns {
            self.segments.push([ns, ns]);
        }
        let segment = self.segments.len() - 1;
        let [first, last] = &mut self.segments[segment];
        (*first, *last) = (ns.min(*first), ns.max(*last));
        self.last_ns = ns;
        self.first_ns = self.first_ns.min(ns);
        for (end, value) in values {
            let name = format!("{}{}", topic.name, clean(&end));
            if !self.numbers.contains_key(&name) && self.numbers.len() >= MOST_CHANNELS {
                return Err(too_large(MOST_CHANNELS, "channels"));
            }
            self.undefined += usize::from(!value.is_finite());
            self.numbers.entry(name).or_default().push(Reading { ns, stamp_ns, segment, value });
        }
        Ok(())
    }

    fn warnings(&self) -> Vec<String> {
        let counts = [
            (self.damaged_chunks, "chunk(s) are damaged and were left out; their readings are missing"),
            (self.unread, "message(s) do not fit their type and were left out"),
            (self.undefined, "reading(s) are infinite or not a number and count as missing"),
        ];
        counts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect()
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
            .filter_map(|(place, name)| {
                let values = column(place);
                // The pressure of a simulated pad is undefined where nothing touches it; other gaps are gaps.
                let values = if field("source") == "sim" { filled(name, values)? } else { values };
                values.iter().any(|value| value.is_finite()).then(|| (cleaned(name), values))
            })
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
        let [size, shape] = [size, shape].map(|word| word.map(str::to_owned));
        Ok(ImportedTrial { name: id, label, size, shape, session: None, signals })
    }

    /// Trials of another program: one for each run of its clock.
    fn foreign(&mut self, mapping: &Mapping, label: &str) -> Result<Import, ImportError> {
        let runs = runs(&self.segments);
        let by_stamps = self.stamped().filter(|_| self.in_bursts());
        let mut warnings = self.warnings();
        if runs.iter().any(|run| *run > 0) {
            warnings.push("its clock runs more than once; each run is a trial".to_owned());
        }
        if by_stamps.is_some() {
            warnings.push("its messages were logged in bursts; the times are those of their headers".to_owned());
        }
        let mut series = Series::default();
        for (name, readings) in &self.numbers {
            for reading in readings {
                let ns = if by_stamps.is_some() { reading.stamp_ns.unwrap_or(reading.ns) } else { reading.ns };
                let origin = by_stamps.unwrap_or(self.first_ns);
                let t_s = (i128::from(ns) - i128::from(origin)) as f64 * 1e-9;
                let run = runs.get(reading.segment).copied().unwrap_or(0);
                series.push(run, name, t_s, reading.value).map_err(|fault| ImportError::new(self.file, fault))?;
            }
        }
        let singles = series.singles().join(", ");
        if !singles.is_empty() {
            warnings.push(format!("a single reading, held at all times: {singles}"));
        }
        let Some(text) = series.into_csv(&clean(label)) else {
            return Err(ImportError::new(self.file, self.nothing()));
        };
        let channels = Mapping { channels: mapping.channels.clone(), ..Mapping::default() };
        let mut import = read_made(text, self.file, &channels, label)?;
        let others: Vec<String> =
            self.topics.values().filter(|topic| topic.kind.is_none()).map(Topic::described).take(LISTED).collect();
        if !others.is_empty() {
            warnings.push(format!("topics that cannot be read were left out: {}", others.join(", ")));
        }
        warnings.append(&mut import.warnings);
        Ok(Import { trials: import.trials, warnings })
    }

    /// Why nothing can be imported.
    fn nothing(&self) -> String {
        let counts: Vec<usize> = self.numbers.values().map(Vec::len).collect();
        if !counts.is_empty() {
            return "each of its channels has a single reading; a trial needs at least two at different times"
                .to_owned();
        }
        let mut topics: Vec<String> = self.topics.values().take(LISTED).map(Topic::described).collect();
        if topics.is_empty() {
            topics.push("no topics".to_owned());
        }
        format!(
            "it has no channel that can be imported; JointState, FluidPressure, WrenchStamped, Float32, Float64, Int32, \
             UInt16 and arrays of floats can be, in CDR. It has: {}",
            topics.join(", ")
        )
    }

    /// The first time of the headers (ns), where all readings have one and these rise.
    fn stamped(&self) -> Option<u64> {
        let all = || self.numbers.values().flatten();
        let first = all().filter_map(|reading| reading.stamp_ns).min()?;
        all().all(|reading| reading.stamp_ns.is_some_and(|ns| ns > 0)).then_some(first)
    }

    /// True when the messages of the channel with most readings were logged in bursts: most of them follow each other in less
    /// than a tenth of the interval between their headers.
    fn in_bursts(&self) -> bool {
        let Some(clock) = self.numbers.values().max_by_key(|readings| readings.len()) else { return false };
        let steps = |ns: &dyn Fn(&Reading) -> u64| {
            let steps = clock.windows(2).map(|pair| ns(&pair[1]).saturating_sub(ns(&pair[0])));
            let mut steps: Vec<u64> = steps.collect();
            let middle = steps.len() / 2;
            if steps.is_empty() { 0 } else { *steps.select_nth_unstable(middle).1 }
        };
        let stamps = steps(&|reading| reading.stamp_ns.unwrap_or(0));
        stamps > 0 && steps(&|reading| reading.ns) < stamps / 10
    }
}

/// Topics that are listed at most.
const LISTED: usize = 20;
/// A time that falls by more than this begins a new segment (ns).
const FALL_NS: u64 = 500_000_000;

/// Run of each segment: segments that do not overlap in time are one run, in whatever order they stand.
fn runs(segments: &[[u64; 2]]) -> Vec<usize> {
    let mut runs: Vec<Vec<[u64; 2]>> = Vec::new();
    let mut found = Vec::with_capacity(segments.len());
    for segment in segments {
        let overlaps = |other: &[u64; 2]| segment[0] < other[1] && other[0] < segment[1];
        let at = runs.iter().position(|run| !run.iter().any(overlaps)).unwrap_or(runs.len());
        if at == runs.len() {
            runs.push(Vec::new());
        }
        runs[at].push(*segment);
        found.push(at);
    }
    found
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

/// A name of this program's own file, which keeps its unit.
fn cleaned(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { '_' } else { c }).take(LONGEST_NAME).collect()
}

/// A name that stands in one field of a table: no separators, brackets and control characters, not too long.
fn clean(text: &str) -> String {
    let bad = |c: char| c.is_control() || ",;\"()[]".contains(c);
    text.trim_start_matches('/').chars().map(|c| if bad(c) { '_' } else { c }).take(LONGEST_NAME / 2).collect()
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
        let import = read_bag(&foreign()[..], "bag.mcap", &Mapping::default(), "mug").expect("reads");
        assert_eq!(import.trials.len(), 1);
        let trial = &import.trials[0];
        assert_eq!((trial.label.as_str(), trial.signals.len()), ("mug", 100));
        assert_eq!(trial.signals.channels, ["arm/joints_a_b", "arm/joints_c", "grip _N_"]);
        // The slower topic lies on straight lines between its samples.
        assert_eq!(trial.signals.row(15), [15.0, 0.5, 30.0]);
        assert!((trial.signals.t_s[15] - 0.15).abs() < 1e-9);
    }

    /// A file of forces at these times: log time, time of the header (ns), and value.
    fn of_forces(messages: impl Iterator<Item = (u64, u64, f64)>) -> Vec<u8> {
        let mut out = McapWriter::new(Vec::new(), "another program").expect("writes");
        let kind = MessageKind::FluidPressure;
        let schema = out.schema(kind.name(), &kind.definition());
        let channel = out.channel(schema, "/pad", &Pairs::new());
        for (logged, stamp, value) in messages {
            out.message(channel, logged, &messages::fluid_pressure(stamp, value)).expect("writes");
        }
        out.finish().expect("writes")
    }

    fn read(bytes: &[u8]) -> Import {
        read_bag(bytes, "a.mcap", &Mapping::default(), "mug").expect("reads")
    }

    const MS: u64 = 1_000_000;

    #[test]
    fn times_of_headers_count_where_messages_were_logged_in_bursts() {
        let bursts =
            of_forces((0..100).map(|n| (1000 * MS + n / 10 * 200 * MS + n % 10, 5000 * MS + n * 20 * MS, n as f64)));
        let import = read(&bursts);
        let signals = &import.trials[0].signals;
        assert!(signals.len() == 100 && (signals.t_s[99] - 1.98).abs() < 1e-9, "{:?}", signals.t_s);
        assert_eq!(signals.values[37], 37.0);
        assert!(import.warnings[0].contains("bursts"), "{:?}", import.warnings);
        // Steady log times are kept, whatever the headers say.
        let steady = of_forces((0..100).map(|n| (1000 * MS + n * 10 * MS, 5000 * MS + n * 20 * MS, n as f64)));
        assert!((read(&steady).trials[0].signals.t_s[99] - 0.99).abs() < 1e-9);
    }

    #[test]
    fn each_run_of_a_clock_is_a_trial_and_chunks_in_any_order_are_one() {
        let run = |from: u64, count: u64| (0..count).map(move |n| (from + n * 10 * MS, 0, n as f64));
        let twice = read(&of_forces(run(2000 * MS, 90).chain(run(2000 * MS, 60))));
        assert_eq!(twice.trials.iter().map(|trial| trial.signals.len()).collect::<Vec<_>>(), [90, 60]);
        assert!(twice.warnings[0].contains("each run is a trial"), "{:?}", twice.warnings);
        let swapped = read(&of_forces(run(3000 * MS, 100).chain(run(2000 * MS, 100))));
        assert_eq!((swapped.trials.len(), swapped.trials[0].signals.len()), (1, 200));
    }

    #[test]
    fn what_is_missing_is_a_gap() {
        let mut out = McapWriter::new(Vec::new(), "another program").expect("writes");
        let kind = MessageKind::Numbers;
        let schema = out.schema(kind.name(), &kind.definition());
        let channel = out.channel(schema, "/taxels", &Pairs::new());
        for n in 0..100u64 {
            let width = if n < 50 { 2 } else { 1 };
            let values = [1.0, if n == 10 { f64::NAN } else { 2.0 }].into_iter().take(width).collect::<Vec<_>>();
            out.message(channel, n * 20 * MS, &messages::numbers("taxels", values.into_iter())).expect("writes");
        }
        let import = read(&out.finish().expect("writes"));
        let gaps = import.trials[0].signals.gaps();
        assert!(gaps.len() == 1 && gaps[0].channels == [1] && gaps[0].samples.end == 100, "{gaps:?}");
        let said = import.warnings.join("; ");
        assert!(said.contains("1 reading(s) are infinite") && said.contains("no readings of taxels_1"), "{said}");
    }

    #[test]
    fn files_without_numbers_say_what_they_have() {
        let mut out = McapWriter::new(Vec::new(), "x").expect("writes");
        let schema = out.schema("sensor_msgs/msg/Image", "uint32 height\n");
        out.channel(schema, "/camera", &Pairs::new());
        let error = read_bag(&out.finish().expect("writes")[..], "a.mcap", &Mapping::default(), "mug")
            .expect_err("refused")
            .to_string();
        assert!(error.contains("JointState") && error.contains("camera (sensor_msgs/msg/Image)"), "{error}");
        let cut = &foreign()[..40];
        assert!(
            read_bag(cut, "a.mcap", &Mapping::default(), "mug").expect_err("refused").to_string().contains("no topics")
        );
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
            if let Ok(import) = read_bag(&bytes[..], "a.mcap", &Mapping::default(), "mug") {
                for trial in &import.trials {
                    prop_assert!(trial.signals.values.iter().all(|value| !value.is_infinite()));
                    prop_assert!(trial.signals.t_s.is_sorted_by(|a, b| a < b));
                }
            }
        }

        /// Any messages of the right type, however malformed, are left out or read.
        #[test]
        fn any_messages_end_in_order(messages in proptest::collection::vec(any::<Vec<u8>>(), 0..20), kind in 0usize..11) {
            let kinds = ["sensor_msgs/msg/JointState", "std_msgs/msg/Float64MultiArray", "std_msgs/msg/Float32",
                "sensor_msgs/msg/FluidPressure", "std_msgs/msg/Float64", "std_msgs/msg/Float32MultiArray",
                "std_msgs/msg/String", "tf2_msgs/msg/TFMessage", "std_msgs/msg/Int32", "std_msgs/msg/UInt16",
                "geometry_msgs/msg/WrenchStamped"];
            let mut out = McapWriter::new(Vec::new(), "x").expect("writes");
            let schema = out.schema(kinds[kind], "");
            let channel = out.channel(schema, "/a", &Pairs::new());
            for (n, message) in messages.iter().enumerate() {
                let message: Vec<u8> = [0, 1, 0, 0].into_iter().chain(message.iter().copied()).collect();
                out.message(channel, n as u64 * 1_000_000, &message).expect("writes");
            }
            let _outcome = read_bag(&out.finish().expect("writes")[..], "a.mcap", &Mapping::default(), "mug");
        }
    }
}
