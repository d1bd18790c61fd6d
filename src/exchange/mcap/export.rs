//! Trials as MCAP.

use super::container::{McapWriter, Pairs};
use super::messages::{self, MessageKind};
use super::{CHANNELS, TAXELS, TRIAL};
use crate::content::{TrialContent, joint_name, segment_name, segment_pose};
use crate::format::{ExchangeError, TrialExport, new_file};
use crate::taxels::LoadedTaxel;
use crate::urdf::gripper_urdf;
use palpate_geometry::Pose;
use palpate_lab::datasets::scene_hash;
use palpate_learn::Pmf;
use palpate_sim::gripper::Side;
use palpate_store::{FileKind, NewFile};
use palpate_tactile::Quantity;
use palpate_tactile::trial::TrialSource;
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

/// Time between trials that were not recorded one after the other (ns).
const BETWEEN: u64 = 1_000_000_000;

/// Length of the line of one newton (m): forces on taxels are tenths of that.
const PER_NEWTON: f64 = 0.05;

/// Writes trials into one file.
pub(super) fn write(export: &TrialExport<'_>, path: &Path, kind: FileKind) -> Result<(), ExchangeError> {
    let failed = |error: io::Error| ExchangeError::cannot_write(path, &error);
    let library = format!("palpate {}", env!("CARGO_PKG_VERSION"));
    let mut out = Bag {
        writer: McapWriter::new(new_file(path, kind)?, &library).map_err(failed)?,
        schemas: BTreeMap::new(),
        channels: BTreeMap::new(),
        taxels: export.taxels,
    };
    let mut earliest = 0;
    for content in export.contents()? {
        let content = content?;
        let recorded = utc_ns(&content.open.created).unwrap_or(0);
        let end = out.trial(&content, recorded.max(earliest)).map_err(failed)?;
        earliest = end + BETWEEN;
    }
    out.writer.finish().and_then(NewFile::finish).map_err(failed)
}

/// A file, with the schemas and channels that it has so far.
struct Bag<W: Write> {
    writer: McapWriter<W>,
    schemas: BTreeMap<&'static str, u16>,
    channels: BTreeMap<(String, Pairs), u16>,
    /// Forces on taxels, and the mesh of the object, are written.
    taxels: bool,
}

impl<W: Write> Bag<W> {
    /// Number of a channel, which is added where it is new.
    fn channel(&mut self, kind: MessageKind, topic: &str, metadata: Pairs) -> u16 {
        if let Some(known) = self.channels.get(&(topic.to_owned(), metadata.clone())) {
            return *known;
        }
        let schema = match self.schemas.get(kind.name()) {
            Some(known) => *known,
            None => {
                let id = self.writer.schema(kind.name(), &kind.definition());
                self.schemas.insert(kind.name(), id);
                id
            }
        };
        let id = self.writer.channel(schema, topic, &metadata);
        self.channels.insert((topic.to_owned(), metadata), id);
        id
    }

    fn text(&mut self, topic: &str, ns: u64, text: &str) -> io::Result<()> {
        let channel = self.channel(MessageKind::Text, topic, Pairs::new());
        self.writer.message(channel, ns, &messages::text(text))
    }

    /// Writes a trial that begins at a time (ns); returns the time of its end.
    fn trial(&mut self, content: &TrialContent, begin: u64) -> io::Result<u64> {
        let open = &content.open;
        let first_s = open.span_s()[0];
        let at = |t_s: f64| begin + ((t_s - first_s).max(0.0) * 1e9).round() as u64;
        let end = at(open.span_s()[1]);
        if open.simulated.is_some() {
            let scene = &open.header.scene;
            // An object whose file is gone is not drawn.
            let object = if self.taxels { scene.load_object().ok().flatten() } else { None };
            let surface = object.as_ref().map(|object| object.surface.as_ref());
            self.text("/robot_description", begin, &gripper_urdf(&scene.gripper, surface))?;
        }
        self.text("/label", begin, &label_json(content).to_string())?;
        for span in &open.phases {
            self.text("/phase", at(span.from_s), span.phase.name())?;
        }
        self.samples(content, &at)?;
        self.motion(content, &at)?;
        if self.taxels {
            self.forces(content, &at)?;
        }
        self.answers(content, &at)?;
        self.metadata(content, [begin, end])?;
        let id = open.id;
        if open.source == TrialSource::Simulated {
            let scene = open.header.scene.to_toml();
            self.writer.attachment(begin, &format!("trial_{id}_scene.toml"), "application/toml", scene.as_bytes())?;
        }
        if let Some(calibrations) = &content.calibrations {
            let name = format!("trial_{id}_calibrations.json");
            self.writer.attachment(begin, &name, "application/json", calibrations.as_bytes())?;
        }
        Ok(end)
    }

    /// All channels together, and the line pressure.
    fn samples(&mut self, content: &TrialContent, at: &dyn Fn(f64) -> u64) -> io::Result<()> {
        let open = &content.open;
        let mut names = vec!["t_s"];
        names.extend(open.columns.iter().map(|column| column.name.as_str()));
        let mut units = vec!["s"];
        units.extend(open.columns.iter().map(|column| column.unit));
        let json = |texts: &[&str]| serde_json::Value::from(texts.to_vec()).to_string();
        let metadata = Pairs::from([("names".to_owned(), json(&names)), ("units".to_owned(), json(&units))]);
        let channels = self.channel(MessageKind::Numbers, CHANNELS, metadata);
        let line = self.channel(MessageKind::FluidPressure, "/line_pressure", Pairs::new());
        let bends = |side: Side| {
            open.columns.iter().find(move |column| {
                column
                    .channel
                    .as_ref()
                    .is_some_and(|own| own.quantity == Quantity::Curvature && own.side() == Some(side))
            })
        };
        let strips: Vec<_> =
            if open.simulated.is_none() { Side::BOTH.into_iter().filter_map(bends).collect() } else { Vec::new() };
        let strip_names: Vec<String> = strips.iter().map(|column| column.name.clone()).collect();
        for k in content.samples.iter().copied() {
            let t_s = open.t_s[k];
            let ns = at(t_s);
            let mut row = vec![t_s];
            row.extend(open.columns.iter().map(|column| f64::from(column.values[k])));
            self.writer.message(channels, ns, &messages::numbers("channels", row.into_iter()))?;
            if open.line_bar[k].is_finite() {
                self.writer.message(line, ns, &messages::fluid_pressure(ns, 1e5 * open.line_bar[k]))?;
            }
            if !strips.is_empty() {
                let joints = self.channel(MessageKind::JointState, "/joint_states", Pairs::new());
                let read: Vec<f64> = strips.iter().map(|column| f64::from(column.values[k])).collect();
                self.writer.message(joints, ns, &messages::joint_state(ns, &strip_names, &read))?;
            }
        }
        Ok(())
    }

    /// Joints and poses of a simulated trial.
    fn motion(&mut self, content: &TrialContent, at: &dyn Fn(f64) -> u64) -> io::Result<()> {
        let Some((facts, frames)) = content.simulated() else { return Ok(()) };
        let gripper = &content.open.header.scene.gripper;
        let joints = gripper.finger.joints;
        let names: Vec<String> = Side::BOTH.iter().flat_map(|s| (1..=joints).map(|j| joint_name(*s, j))).collect();
        let states = self.channel(MessageKind::JointState, "/joint_states", Pairs::new());
        let poses = self.channel(MessageKind::Transforms, "/tf", Pairs::new());
        for frame in frames {
            let ns = at(frame.t);
            self.writer.message(states, ns, &messages::joint_state(ns, &names, &frame.q))?;
            let world_from_gripper = frame.world_from_gripper(&facts.world_from_gripper);
            let mut placed = vec![("palm".to_owned(), world_from_gripper)];
            for side in Side::BOTH {
                for segment in 0..=joints {
                    let pose = world_from_gripper * segment_pose(frame, gripper, side, segment);
                    placed.push((segment_name(side, segment), pose));
                }
            }
            placed.extend(frame.world_from_object.map(|pose: Pose| ("object".to_owned(), pose)));
            self.writer.message(poses, ns, &messages::transforms(ns, &placed))?;
        }
        Ok(())
    }

    /// Forces on the taxels of a simulated trial, as numbers and as lines in the world.
    fn forces(&mut self, content: &TrialContent, at: &dyn Fn(f64) -> u64) -> io::Result<()> {
        let (Some((facts, frames)), Some(taxels)) = (content.simulated(), content.taxels()) else { return Ok(()) };
        let [fingers, rows, columns] = taxels.shape();
        let axes = [("finger", fingers), ("row", rows), ("column", columns), ("force", 3)];
        let names = |names: &[&str]| serde_json::Value::from(names.to_vec()).to_string();
        let metadata = [
            ("finger", names(&Side::BOTH.map(Side::name))),
            ("force", names(&["normal", "shear_along", "shear_across"])),
            ("unit", "N".to_owned()),
            ("position", serde_json::json!(taxels.positions()).to_string()),
        ];
        let metadata = metadata.map(|(name, value)| (name.to_owned(), value)).into();
        let numbers = self.channel(MessageKind::SmallNumbers, TAXELS, metadata);
        let lines = self.channel(MessageKind::Markers, "/palpate/forces", Pairs::new());
        for frame in frames {
            let ns = at(frame.t);
            self.writer.message(numbers, ns, &messages::array(&axes, taxels.forces(frame).as_flattened()))?;
            let world_from_gripper = frame.world_from_gripper(&facts.world_from_gripper);
            let line = |loaded: LoadedTaxel| {
                [loaded.place, loaded.place + PER_NEWTON * loaded.force].map(|end| world_from_gripper.point(end))
            };
            let sets = Side::BOTH.map(|side| (side.name(), taxels.loaded(frame, side).map(line).collect()));
            self.writer.message(lines, ns, &messages::lines(ns, &sets))?;
        }
        Ok(())
    }

    /// Probabilities of classes at each sample, and the verdict.
    fn answers(&mut self, content: &TrialContent, at: &dyn Fn(f64) -> u64) -> io::Result<()> {
        let open = &content.open;
        let Some(last) = open.answers.last() else { return Ok(()) };
        let classes: Vec<&str> = last.labels.classes.iter().map(|class| class.name.as_str()).collect();
        let json = serde_json::Value::from(classes.clone()).to_string();
        let channel = self.channel(
            MessageKind::Numbers,
            "/recognition/probabilities",
            Pairs::from([("classes".to_owned(), json)]),
        );
        for k in content.samples.iter().copied() {
            let Some(pmf) = open.answers.get(k).and_then(|answer| answer.verdict.as_ref()).map(|own| &own.pmf) else {
                continue;
            };
            let row = pmf.probabilities().iter().copied();
            self.writer.message(channel, at(open.t_s[k]), &messages::numbers("probabilities", row))?;
        }
        let Some(verdict) = &last.verdict else { return Ok(()) };
        let named = |pmf: &Pmf, names: &[&str]| -> serde_json::Map<String, serde_json::Value> {
            names.iter().zip(pmf.probabilities()).map(|(name, p)| ((*name).to_owned(), (*p).into())).collect()
        };
        let mut report = serde_json::json!({
            "decided": last.decided(),
            "probabilities": named(&verdict.pmf, &classes),
        });
        if let (Some(own), Some(report)) = (&verdict.properties, report.as_object_mut()) {
            let list = |all: &[String], pmf: &Pmf| named(pmf, &all.iter().map(String::as_str).collect::<Vec<_>>());
            report.insert("size".to_owned(), list(&last.labels.sizes, &own.size).into());
            report.insert("shape".to_owned(), list(&last.labels.shapes, &own.shape).into());
        }
        self.text("/recognition/verdict", at(open.span_s()[1]), &report.to_string())
    }

    fn metadata(&mut self, content: &TrialContent, [begin, end]: [u64; 2]) -> io::Result<()> {
        let open = &content.open;
        let label = label_json(content);
        let mut pairs = Pairs::new();
        for (name, value) in label.as_object().into_iter().flatten() {
            let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            pairs.insert(name.clone(), text);
        }
        for (name, number) in [("begin_ns", begin), ("end_ns", end), ("samples", content.samples.len() as u64)] {
            pairs.insert(name.to_owned(), number.to_string());
        }
        let phases: Vec<serde_json::Value> = open
            .phases
            .iter()
            .map(|span| serde_json::json!({"phase": span.phase.name(), "from_s": span.from_s, "to_s": span.to_s}))
            .collect();
        pairs.insert("phases".to_owned(), serde_json::Value::from(phases).to_string());
        self.writer.metadata(TRIAL, &pairs)
    }
}

/// Label and origin of a trial.
fn label_json(content: &TrialContent) -> serde_json::Value {
    let open = &content.open;
    let row = content.row.as_ref();
    let mut label = serde_json::json!({
        "trial": open.id,
        "object": open.header.object,
        "source": open.source.name(),
        "created": open.created,
        "version": open.header.version,
        "collection": open.header.collection.clone().unwrap_or_default(),
        "note": row.map(|row| row.note.clone()).unwrap_or_default(),
        "tags": row.map(|row| row.tags.clone()).unwrap_or_default(),
        "unsure": row.is_some_and(|row| row.unsure),
    });
    if let (TrialSource::Simulated, Some(label)) = (open.source, label.as_object_mut()) {
        label.insert("seed".to_owned(), open.header.seed.into());
        label.insert("scene".to_owned(), scene_hash(&open.header.scene).into());
        label.insert("layout".to_owned(), open.sensors.layout.clone().into());
    }
    label
}

/// Nanoseconds since 1970 of a time of the store, `2026-11-21T15:36:00.123Z`.
pub(super) fn utc_ns(text: &str) -> Option<u64> {
    let (date, time) = text.strip_suffix('Z').unwrap_or(text).split_once('T')?;
    let mut date = date.split('-').map(|part| part.parse::<i64>().ok());
    let (year, month, day) = (date.next()??, date.next()??, date.next()??);
    let mut time = time.split(':');
    let (hour, minute) = (time.next()?.parse::<i64>().ok()?, time.next()?.parse::<i64>().ok()?);
    let seconds = time.next()?.parse::<f64>().ok()?;
    if !(1970..=2200).contains(&year) || !(1..=12).contains(&month) || !(0.0..62.0).contains(&seconds) {
        return None;
    }
    // Days from the civil calendar (Hinnant, "chrono-Compatible Low-Level Date Algorithms").
    let (y, m) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let (era, of_era) = (y.div_euclid(400), y.rem_euclid(400));
    let of_year = (153 * m + 2) / 5 + day - 1;
    let days = era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468;
    let whole = u64::try_from((days * 24 + hour) * 3600 + minute * 60).ok()?;
    Some(whole * 1_000_000_000 + (seconds * 1e3).round() as u64 * 1_000_000)
}

#[cfg(test)]
mod tests {
    use super::super::cdr::CdrReader;
    use super::super::reader::{ContainerFault, Record, read_records};
    use super::*;
    use crate::tests::{assert_sums, ideal_forces, mixed_store};
    use palpate_lab::inspection::OpenOptions;

    #[test]
    fn messages_of_taxels_add_up_to_the_ideal_force() -> Result<(), Box<dyn std::error::Error>> {
        let (folder, store) = mixed_store();
        let path = folder.path().join("out.mcap");
        let options = OpenOptions::default();
        let export =
            TrialExport { store: &store, ids: &[1, 2], options: &options, taxels: true, is_stopped: &|| false };
        crate::write_trials(&export, &path)?;
        let (mut topics, mut messages) = (BTreeMap::new(), BTreeMap::<String, Vec<Vec<u8>>>::new());
        read_records(std::fs::File::open(&path)?, |record| {
            match record {
                Record::Channel { id, topic, .. } => drop(topics.insert(id, topic.to_owned())),
                Record::Message { channel, data, .. } => {
                    messages.entry(topics[&channel].clone()).or_default().push(data.to_owned());
                }
                _ => {}
            }
            Ok::<(), ContainerFault>(())
        })?;
        let wanted = ideal_forces(&store, 1);
        let trial = store.load(1)?;
        assert_eq!((messages[TAXELS].len(), messages["/palpate/forces"].len()), (wanted.len(), wanted.len()));
        for (k, (data, wanted)) in messages[TAXELS].iter().zip(wanted).enumerate() {
            let mut read = CdrReader::new(data).expect("a message");
            let axes = read.u32().expect("axes");
            let axis = |read: &mut CdrReader<'_>| (read.text().expect("a name").to_owned(), [read.u32(), read.u32()]);
            let axes: Vec<_> = (0..axes).map(|_| axis(&mut read)).collect();
            assert_eq!(axes[1], ("row".to_owned(), [Some(40), Some(480)]));
            assert_eq!((read.u32(), axes.len()), (Some(0), 4));
            let numbers = read.small_numbers().expect("numbers");
            assert_sums(&numbers.iter().step_by(3).map(|number| *number as f32).collect::<Vec<_>>(), wanted);
            // Two ends of three numbers for each loaded taxel.
            let ends = 48 * trial.frames()[k].taxels.len();
            let size = messages["/palpate/forces"][k].len();
            assert!((ends + 400..ends + 800).contains(&size), "{size} bytes with {ends} of lines");
        }
        let urdf = String::from_utf8_lossy(&messages["/robot_description"][0]);
        assert!(urdf.contains("<child link=\"object\"/>") && urdf.contains("data:model/stl;base64,AAAA"));
        Ok(())
    }

    #[test]
    fn times_of_the_store_are_nanoseconds_since_1970() {
        assert_eq!(utc_ns("1970-01-01T00:00:00.000Z"), Some(0));
        assert_eq!(utc_ns("2026-11-21T15:36:00.123Z"), Some(1_795_275_360_123_000_000));
        assert_eq!(utc_ns("2024-02-29T23:59:59Z"), Some(1_709_251_199_000_000_000));
        for wrong in ["", "yesterday", "2026-13-01T00:00:00Z", "2026-01-01", "2026-01-01T00:00:99Z"] {
            assert_eq!(utc_ns(wrong), None, "{wrong}");
        }
    }
}
