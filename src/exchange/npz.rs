//! Arrays of trials for numpy: an archive of NPY files, one array each. Shapes are in the help page on formats.
//!
//! NPY is a header of text, padded to 64 bytes, and the numbers in rows. Source: numpy, *numpy.lib.format*, version 1.0.

use crate::content::{TrialContent, channels_of, common_pads};
use crate::format::{ExchangeError, Import, ImportError, TrialExport, TrialFormat, Written, new_file};
use crate::mapping::Mapping;
use crate::npz_import::{names_of, read_npz};
use crate::taxels::{NORMAL, POSITION, SHEAR};
use palpate_geometry::Pose;
use palpate_lab::datasets::scene_hash;
use palpate_lab::inspection::TouchPhase;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::Side;
use palpate_store::{FileKind, NewFile};
use std::io::{self, Write};
use std::path::Path;
use zip::write::SimpleFileOptions;

/// Most memory for all arrays (bytes).
const MOST_BYTES: u64 = 4 << 30;
/// Numbers of a pose: x y z, then the rotation as qx qy qz qw.
const POSE: usize = 7;

/// Archives of numpy.
pub(crate) struct Npz;

impl TrialFormat for Npz {
    fn kind(&self) -> FileKind {
        FileKind::Other { title: "NPZ archive", endings: &["npz"], begin: b"PK" }
    }

    fn write(&self, export: &TrialExport<'_>, path: &Path) -> Result<Written, ExchangeError> {
        let file = new_file(path, self.kind())?;
        let mut trials = Vec::new();
        let mut bytes = 0;
        for trial in export.contents()? {
            let trial = trial?;
            let joints = joints_of(&trial);
            let taxels = trial.taxels().filter(|_| export.taxels).map_or(0, |taxels| taxels.count());
            let each = (8 * (trial.open.columns.len() + joints + 2 * POSE + 4) + 12 * taxels) as u64;
            bytes = u64::max(bytes, each * trial.samples.len() as u64);
            let gigabytes = (bytes * export.ids.len() as u64) as f64 / 1e9;
            if bytes.saturating_mul(export.ids.len() as u64) > MOST_BYTES {
                let most = MOST_BYTES >> 30;
                return Err(ExchangeError::Refused(format!(
                    "the arrays would take {gigabytes:.1} GB, more than the limit of {most} GB; export fewer trials at once"
                )));
            }
            trials.push(trial);
        }
        let pads = if export.taxels { Some(common_pads(&trials)?) } else { None };
        let mut archive = Archive { zip: zip::ZipWriter::new(file) };
        let written = arrays(&trials, pads, &mut archive).and_then(|()| archive.zip.finish().map_err(io::Error::other));
        written.and_then(NewFile::finish).map_err(|e| ExchangeError::cannot_write(path, &e))?;
        Ok(Written::whole(path))
    }

    fn read(&self, path: &Path, mapping: &Mapping) -> Result<Import, ImportError> {
        read_npz(path, mapping)
    }

    fn columns(&self, path: &Path, _mapping: &Mapping) -> Result<Vec<String>, ImportError> {
        names_of(path)
    }
}

/// Samples of trials in the order of arrays; none beyond the end of a trial.
fn places(trials: &[TrialContent], samples: usize) -> impl Iterator<Item = (&TrialContent, Option<usize>)> {
    trials.iter().flat_map(move |trial| (0..samples).map(move |k| (trial, trial.samples.get(k).copied())))
}

/// Arrays of trials whose pads have a shape; without one, no taxels.
fn arrays<W: Write + io::Seek>(
    trials: &[TrialContent],
    pads: Option<[usize; 3]>,
    archive: &mut Archive<W>,
) -> io::Result<()> {
    let count = trials.len();
    let samples = trials.iter().map(|trial| trial.samples.len()).max().unwrap_or(0);
    let channels = channels_of(trials);
    archive.texts("channels", channels.iter().map(|(name, _)| (*name).to_owned()))?;
    archive.texts("units", channels.iter().map(|(_, unit)| (*unit).to_owned()))?;
    archive.array("trial", &[count], trials.iter().map(|trial| trial.open.id))?;
    archive.array("samples", &[count], trials.iter().map(|trial| trial.samples.len() as i64))?;
    archive.array("seed", &[count], trials.iter().map(|trial| trial.open.header.seed.cast_signed()))?;
    archive.texts("label", trials.iter().map(|trial| trial.open.header.object.clone()))?;
    archive.texts("source", trials.iter().map(|trial| trial.open.source.name().to_owned()))?;
    archive.texts("created", trials.iter().map(|trial| trial.open.created.clone()))?;
    archive.texts("scene", trials.iter().map(|trial| scene_hash(&trial.open.header.scene)))?;
    archive.texts("phase_names", TouchPhase::ALL.iter().map(|phase| phase.name().to_owned()))?;
    let places = || places(trials, samples);
    let grid = [count, samples];
    let or_nan = |value: Option<f64>| value.unwrap_or(f64::NAN);
    archive.array("t_s", &grid, places().map(|(trial, k)| or_nan(k.map(|k| trial.open.t_s[k]))))?;
    archive.array("line_bar", &grid, places().map(|(trial, k)| or_nan(k.map(|k| trial.open.line_bar[k]))))?;
    let columns = |trial: &TrialContent| -> Vec<Option<usize>> {
        channels.iter().map(|(name, _)| trial.open.columns.iter().position(|column| column.name == *name)).collect()
    };
    let values = trials.iter().flat_map(|trial| {
        let columns = columns(trial);
        (0..samples).flat_map(move |k| {
            let k = trial.samples.get(k).copied();
            let value = move |c: Option<usize>| c.zip(k).map_or(f32::NAN, |(c, k)| trial.open.columns[c].values[k]);
            columns.clone().into_iter().map(value)
        })
    });
    archive.array("values", &[count, samples, channels.len()], values)?;
    let phase = |trial: &TrialContent, k: Option<usize>| -> i8 {
        let t_s = k.map_or(f64::NAN, |k| trial.open.t_s[k]);
        let span = trial.open.phases.iter().rfind(|span| span.from_s <= t_s);
        span.and_then(|span| TouchPhase::ALL.iter().position(|own| *own == span.phase)).map_or(-1, |n| n as i8)
    };
    archive.array("phase", &grid, places().map(|(trial, k)| phase(trial, k)))?;
    motion(trials, samples, archive)?;
    if let Some(pads) = pads {
        taxels(trials, (samples, pads), archive)?;
    }
    answers(trials, samples, archive)
}

/// Joints of both fingers of a simulated trial; none of others.
fn joints_of(trial: &TrialContent) -> usize {
    trial.simulated().and_then(|(_, frames)| frames.first()).map_or(0, |frame| frame.q.len())
}

/// Joints and poses, where any trial is simulated.
fn motion<W: Write + io::Seek>(trials: &[TrialContent], samples: usize, archive: &mut Archive<W>) -> io::Result<()> {
    let joints = trials.iter().map(joints_of).max().unwrap_or(0) / 2;
    if joints == 0 {
        return Ok(());
    }
    let frames = || places(trials, samples).map(|(trial, k)| (trial, k.and_then(|k| trial.frame_at(k))));
    let angles = frames().flat_map(|(_, frame)| {
        Side::BOTH.into_iter().flat_map(move |side| {
            let own = frame.map(|frame| frame.joints(side)).unwrap_or_default();
            (0..joints).map(move |joint| own.get(joint).map_or(f32::NAN, |q| *q as f32))
        })
    });
    archive.array("joints", &[trials.len(), samples, 2, joints], angles)?;
    let numbers = |pose: Option<Pose>| -> [f64; POSE] {
        pose.map_or([f64::NAN; POSE], |pose| {
            let (p, r) = (pose.position, pose.rotation);
            [p.x, p.y, p.z, r.x, r.y, r.z, r.w]
        })
    };
    let shape = [trials.len(), samples, POSE];
    let pose = |trial: &TrialContent, frame: &Frame| {
        trial.simulated().map(|(facts, _)| frame.world_from_gripper(&facts.world_from_gripper))
    };
    let gripper = frames().flat_map(|(trial, frame)| numbers(frame.and_then(|frame| pose(trial, frame))));
    archive.array("gripper_pose", &shape, gripper)?;
    let object = frames().flat_map(|(_, frame)| numbers(frame.and_then(|frame| frame.world_from_object)));
    archive.array("object_pose", &shape, object)
}

/// Forces on taxels and their places, NaN in trials that have none.
fn taxels<W: Write + io::Seek>(
    trials: &[TrialContent],
    (samples, pads): (usize, [usize; 3]),
    archive: &mut Archive<W>,
) -> io::Result<()> {
    let count = pads.iter().product();
    let forces = || {
        places(trials, samples).flat_map(|(trial, k)| {
            let frame = k.and_then(|k| trial.frame_at(k));
            let forces = trial.taxels().zip(frame).map(|(taxels, frame)| taxels.forces(frame));
            forces.unwrap_or_else(|| vec![[f32::NAN; 3]; count])
        })
    };
    let shape = |before: &[usize], after: &[usize]| [before, &pads, after].concat();
    let grid = [trials.len(), samples];
    archive.array(NORMAL, &shape(&grid, &[]), forces().map(|[normal, ..]| normal))?;
    archive.array(SHEAR, &shape(&grid, &[2]), forces().flat_map(|[_, along, across]| [along, across]))?;
    let positions = trials.iter().flat_map(|trial| {
        let own = trial.taxels().map(|taxels| taxels.positions());
        own.unwrap_or_else(|| vec![[f64::NAN; 3]; count]).into_iter().flatten()
    });
    archive.array(POSITION, &shape(&grid[..1], &[3]), positions.map(|metres| metres as f32))
}

/// Probabilities of classes, where a model answered.
fn answers<W: Write + io::Seek>(trials: &[TrialContent], samples: usize, archive: &mut Archive<W>) -> io::Result<()> {
    let Some(first) = trials.iter().find_map(|trial| trial.open.answers.first()) else { return Ok(()) };
    let classes: Vec<String> = first.labels.classes.iter().map(|class| class.name.clone()).collect();
    let probabilities = trials.iter().flat_map(|trial| {
        let classes = classes.len();
        (0..samples).flat_map(move |k| {
            let answer = trial.samples.get(k).and_then(|k| trial.open.answers.get(*k));
            let pmf = answer.and_then(|answer| answer.verdict.as_ref()).map(|verdict| &verdict.pmf);
            (0..classes).map(move |class| pmf.map_or(f32::NAN, |pmf| pmf.probabilities()[class] as f32))
        })
    });
    archive.array("probabilities", &[trials.len(), samples, classes.len()], probabilities)?;
    archive.texts("classes", classes.into_iter())
}

/// A number of an array.
trait Element: Copy {
    /// Its type, as numpy names it.
    const NAME: &'static str;

    fn put(self, out: &mut Vec<u8>);
}

macro_rules! element {
    ($number:ty, $name:literal) => {
        impl Element for $number {
            const NAME: &'static str = $name;

            fn put(self, out: &mut Vec<u8>) {
                out.extend(self.to_le_bytes());
            }
        }
    };
}

element!(f32, "<f4");
element!(f64, "<f8");
element!(i64, "<i8");
element!(i8, "|i1");

/// The archive that is being written.
struct Archive<W: Write + io::Seek> {
    zip: zip::ZipWriter<W>,
}

impl<W: Write + io::Seek> Archive<W> {
    fn begin(&mut self, name: &str, kind: &str, shape: &[usize]) -> io::Result<()> {
        let options = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored).large_file(true);
        self.zip.start_file(format!("{name}.npy"), options).map_err(io::Error::other)?;
        self.zip.write_all(&header(kind, shape))
    }

    /// Writes numbers, the last axis first.
    fn array<T: Element>(&mut self, name: &str, shape: &[usize], numbers: impl Iterator<Item = T>) -> io::Result<()> {
        self.begin(name, T::NAME, shape)?;
        let mut block = Vec::with_capacity(BLOCK + 16);
        for number in numbers {
            number.put(&mut block);
            if block.len() >= BLOCK {
                self.zip.write_all(&block)?;
                block.clear();
            }
        }
        self.zip.write_all(&block)
    }

    /// Writes texts as an array of one axis, each of equal length in UTF-32.
    fn texts(&mut self, name: &str, texts: impl Iterator<Item = String>) -> io::Result<()> {
        let texts: Vec<Vec<char>> = texts.map(|text| text.chars().collect()).collect();
        let longest = texts.iter().map(Vec::len).max().unwrap_or(0).max(1);
        self.begin(name, &format!("<U{longest}"), &[texts.len()])?;
        for text in texts {
            let codes = text.into_iter().map(u32::from).chain(std::iter::repeat(0)).take(longest);
            let bytes: Vec<u8> = codes.flat_map(u32::to_le_bytes).collect();
            self.zip.write_all(&bytes)?;
        }
        Ok(())
    }
}

/// Numbers are written in blocks of this size (bytes).
const BLOCK: usize = 1 << 16;

/// Header of an NPY file.
fn header(kind: &str, shape: &[usize]) -> Vec<u8> {
    const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
    let sides: Vec<String> = shape.iter().map(|side| format!("{side},")).collect();
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}), }}", sides.concat());
    let length = (MAGIC.len() + 2 + text.len() + 1).next_multiple_of(64);
    let spaces = length - MAGIC.len() - 2 - text.len() - 1;
    text.extend(std::iter::repeat_n(' ', spaces));
    text.push('\n');
    let mut bytes = MAGIC.to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.into_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{assert_sums, ideal_forces, mixed_store};
    use crate::write_trials;
    use palpate_lab::grasping::grasp;
    use palpate_lab::inspection::{OpenOptions, OpenTrial};
    use palpate_sim::scene::Scene;
    use palpate_store::Store;
    use std::collections::BTreeMap;
    use std::io::Read as _;

    #[test]
    fn headers_are_numpy_s() {
        // numpy.lib.format.write_array_header_1_0(f, {'descr': '<f4', 'fortran_order': False, 'shape': (2, 3)}) of numpy 2.4
        // writes 128 bytes that read alike; the shape may end with a comma.
        let bytes = header("<f4", &[2, 3]);
        assert_eq!(bytes.len() % 64, 0);
        assert!(
            bytes.starts_with(b"\x93NUMPY\x01\x00v\x00{'descr': '<f4', 'fortran_order': False, 'shape': (2,3,), }")
        );
        assert!(bytes.ends_with(b" \n"));
        assert!(String::from_utf8_lossy(&header("|i1", &[7])).contains("'shape': (7,), }"));
    }

    /// Arrays of an archive: header and content.
    fn read(path: &Path) -> BTreeMap<String, (String, Vec<u8>)> {
        let mut archive = zip::ZipArchive::new(std::fs::File::open(path).expect("opens")).expect("an archive");
        (0..archive.len())
            .map(|n| {
                let mut file = archive.by_index(n).expect("a file");
                let mut bytes = Vec::new();
                file.read_to_end(&mut bytes).expect("reads");
                let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
                let header = String::from_utf8_lossy(&bytes[10..10 + length]).into_owned();
                (file.name().expect("a name").into_owned(), (header, bytes[10 + length..].to_vec()))
            })
            .collect()
    }

    #[test]
    fn arrays_hold_the_trials_padded_to_the_longest() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let mut store = Store::open(&folder.path().join("trials.sqlite"))?;
        for (object, seconds) in [("lemon", 1.5), ("ball", 2.0)] {
            let mut scene = Scene::default();
            scene.object.source = object.to_owned();
            scene.timing.duration_s = seconds;
            store.insert(&grasp(&scene, scene.load_object()?.as_ref(), 3))?;
        }
        let path = folder.path().join("out.npz");
        let options = OpenOptions::default();
        write_trials(
            &TrialExport { store: &store, ids: &[1, 2], options: &options, taxels: false, is_stopped: &|| false },
            &path,
        )?;
        let arrays = read(&path);
        let shape = |name: &str, wanted: &str| {
            let header = &arrays[&format!("{name}.npy")].0;
            assert!(header.contains(wanted), "{name}: {header}");
        };
        let opened = [1, 2].map(|id| OpenTrial::open(&store, id, &OpenOptions::default()).expect("opens"));
        let longest = opened[1].t_s.len();
        assert!(opened[0].t_s.len() < longest);
        shape("values", &format!("'descr': '<f4', 'fortran_order': False, 'shape': (2,{longest},6,)"));
        shape("t_s", &format!("'descr': '<f8', 'fortran_order': False, 'shape': (2,{longest},)"));
        shape("label", "'descr': '<U5', 'fortran_order': False, 'shape': (2,)");
        shape("object_pose", &format!("(2,{longest},7,)"));
        let joints = store.load(1)?.header.scene.gripper.finger.joints;
        shape("joints", &format!("(2,{longest},2,{joints},)"));
        let values: Vec<f32> =
            arrays["values.npy"].1.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        for (trial, open) in opened.iter().enumerate() {
            for sample in 0..longest {
                for (c, column) in open.columns.iter().enumerate() {
                    let read = values[(trial * longest + sample) * 6 + c];
                    let wanted = column.values.get(sample).copied().unwrap_or(f32::NAN);
                    assert!(read.to_bits() == wanted.to_bits() || (read.is_nan() && wanted.is_nan()));
                }
            }
        }
        let label = &arrays["label.npy"].1;
        assert_eq!(label[..8], [b'l', 0, 0, 0, b'e', 0, 0, 0]);
        Ok(())
    }

    #[test]
    fn taxels_add_up_to_the_ideal_force_and_are_missing_where_there_are_none() -> Result<(), Box<dyn std::error::Error>>
    {
        let (folder, mut store) = mixed_store();
        let path = folder.path().join("out.npz");
        let options = OpenOptions::default();
        let export = |store: &Store, ids: &[i64]| {
            write_trials(&TrialExport { store, ids, options: &options, taxels: true, is_stopped: &|| false }, &path)
        };
        export(&store, &[1, 2])?;
        let arrays = read(&path);
        let numbers = |name: &str, shape: &str| -> Vec<f32> {
            let (header, bytes) = &arrays[&format!("{name}.npy")];
            assert!(header.contains(&format!("'descr': '<f4', 'fortran_order': False, 'shape': {shape}")), "{header}");
            bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
        };
        let wanted = ideal_forces(&store, 1);
        let samples = wanted.len();
        let normal = numbers("taxel_normal", &format!("(2,{samples},2,40,4,)"));
        let shear = numbers("taxel_shear", &format!("(2,{samples},2,40,4,2,)"));
        let position = numbers("taxel_position", "(2,2,40,4,3,)");
        let (own, missing) = normal.split_at(normal.len() / 2);
        own.chunks(320).zip(&wanted).for_each(|(normal, wanted)| assert_sums(normal, *wanted));
        assert!(missing.iter().all(|force| force.is_nan()));
        let trial = store.load(1)?;
        let load = trial.frames().iter().flat_map(|frame| &frame.taxels).max_by(|a, b| a.along.total_cmp(&b.along));
        let load = load.expect("loaded");
        let sample = trial.frames().iter().position(|frame| frame.taxels.contains(load)).expect("is there");
        let place = 2 * (320 * sample + usize::from(load.taxel));
        assert_eq!(shear[place..place + 2], [load.along, load.across]);
        // The first taxel of the left pad: half a pitch from the palm, and from the edge, which is at positive y there.
        assert!((position[1] - 0.0075).abs() < 1e-6 && (position[2] - 0.00125).abs() < 1e-6, "{:?}", &position[..3]);
        assert!(position[960..].iter().all(|metres| metres.is_nan()));

        let mut scene = Scene::default();
        (scene.timing.duration_s, scene.gripper.pad.rows) = (0.1, 20);
        store.insert(&grasp(&scene, None, 0))?;
        let error = export(&store, &[1, 3]).expect_err("refused").to_string();
        assert!(error.contains("trial 1 has 40 x 4") && error.contains("trial 3 has 20 x 4"), "{error}");
        Ok(())
    }
}
