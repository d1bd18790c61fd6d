//! The ROS 2 messages that are written and read: their schemas, and their fields in CDR.

use super::cdr::{CdrReader, CdrWriter};
use glam::{DQuat, DVec3};
use palpate_geometry::Pose;

/// A kind of message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MessageKind {
    JointState,
    FluidPressure,
    Numbers,
    SmallNumbers,
    Number,
    SmallNumber,
    WholeNumber,
    ShortNumber,
    Wrench,
    Transforms,
    Markers,
    Text,
}

const HEADER: &str = "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";
const TIME: &str = "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const LAYOUT: &str = "MSG: std_msgs/MultiArrayLayout\nMultiArrayDimension[] dim\nuint32 data_offset\n";
const VECTOR: &str = "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
const QUATERNION: &str = "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";
const MARKER: &str = "MSG: visualization_msgs/Marker\nstd_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\n\
    geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\nbuiltin_interfaces/Duration lifetime\n\
    bool frame_locked\ngeometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\nstring texture_resource\n\
    sensor_msgs/CompressedImage texture\nUVCoordinate[] uv_coordinates\nstring text\nstring mesh_resource\n\
    MeshFile mesh_file\nbool mesh_use_embedded_materials\n";
const DIMENSION: &str = "MSG: std_msgs/MultiArrayDimension\nstring label\nuint32 size\nuint32 stride\n";

impl MessageKind {
    const ALL: [Self; 12] = [
        Self::JointState,
        Self::FluidPressure,
        Self::Numbers,
        Self::SmallNumbers,
        Self::Number,
        Self::SmallNumber,
        Self::WholeNumber,
        Self::ShortNumber,
        Self::Wrench,
        Self::Transforms,
        Self::Markers,
        Self::Text,
    ];

    /// Name of its schema.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::JointState => "sensor_msgs/msg/JointState",
            Self::FluidPressure => "sensor_msgs/msg/FluidPressure",
            Self::Numbers => "std_msgs/msg/Float64MultiArray",
            Self::SmallNumbers => "std_msgs/msg/Float32MultiArray",
            Self::Number => "std_msgs/msg/Float64",
            Self::SmallNumber => "std_msgs/msg/Float32",
            Self::WholeNumber => "std_msgs/msg/Int32",
            Self::ShortNumber => "std_msgs/msg/UInt16",
            Self::Wrench => "geometry_msgs/msg/WrenchStamped",
            Self::Transforms => "tf2_msgs/msg/TFMessage",
            Self::Markers => "visualization_msgs/msg/MarkerArray",
            Self::Text => "std_msgs/msg/String",
        }
    }

    /// The kind that a schema of any program names.
    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Definition in the language of ROS 2, with those of the types that it uses.
    pub(super) fn definition(self) -> String {
        let (own, used): (&str, &[&str]) = match self {
            Self::JointState => (
                "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
                &[HEADER, TIME],
            ),
            Self::FluidPressure => {
                ("std_msgs/Header header\nfloat64 fluid_pressure\nfloat64 variance\n", &[HEADER, TIME])
            }
            Self::Numbers => ("std_msgs/MultiArrayLayout layout\nfloat64[] data\n", &[LAYOUT, DIMENSION]),
            Self::SmallNumbers => ("std_msgs/MultiArrayLayout layout\nfloat32[] data\n", &[LAYOUT, DIMENSION]),
            Self::Number => ("float64 data\n", &[]),
            Self::SmallNumber => ("float32 data\n", &[]),
            Self::WholeNumber => ("int32 data\n", &[]),
            Self::ShortNumber => ("uint16 data\n", &[]),
            Self::Wrench => (
                "std_msgs/Header header\nWrench wrench\n",
                &["MSG: geometry_msgs/Wrench\nVector3 force\nVector3 torque\n", VECTOR, HEADER, TIME],
            ),
            Self::Transforms => (
                "geometry_msgs/TransformStamped[] transforms\n",
                &[
                    "MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\nTransform \
                     transform\n",
                    "MSG: geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n",
                    VECTOR,
                    QUATERNION,
                    HEADER,
                    TIME,
                ],
            ),
            Self::Markers => (
                "visualization_msgs/Marker[] markers\n",
                &[
                    MARKER,
                    "MSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n",
                    "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n",
                    QUATERNION,
                    VECTOR,
                    "MSG: std_msgs/ColorRGBA\nfloat32 r\nfloat32 g\nfloat32 b\nfloat32 a\n",
                    "MSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n",
                    "MSG: sensor_msgs/CompressedImage\nstd_msgs/Header header\nstring format\nuint8[] data\n",
                    "MSG: visualization_msgs/UVCoordinate\nfloat32 u\nfloat32 v\n",
                    "MSG: visualization_msgs/MeshFile\nstring filename\nuint8[] data\n",
                    HEADER,
                    TIME,
                ],
            ),
            Self::Text => ("string data\n", &[]),
        };
        let bar = "=".repeat(80);
        used.iter().fold(own.to_owned(), |text, part| format!("{text}{bar}\n{part}"))
    }
}

fn header(out: &mut CdrWriter, ns: u64, frame: &str) {
    out.time(ns);
    out.text(frame);
}

/// Positions of joints by name.
pub(super) fn joint_state(ns: u64, names: &[String], positions: &[f64]) -> Vec<u8> {
    let mut out = CdrWriter::new();
    header(&mut out, ns, "palm");
    out.u32(names.len() as u32);
    names.iter().for_each(|name| out.text(name));
    out.numbers(positions.iter().copied());
    out.u32(0);
    out.u32(0);
    out.finish()
}

/// A pressure (Pa).
pub(super) fn fluid_pressure(ns: u64, pressure: f64) -> Vec<u8> {
    let mut out = CdrWriter::new();
    header(&mut out, ns, "line");
    out.f64(pressure);
    out.f64(0.0);
    out.finish()
}

/// A row of numbers.
pub(super) fn numbers(label: &str, values: impl ExactSizeIterator<Item = f64>) -> Vec<u8> {
    let mut out = CdrWriter::new();
    out.u32(1);
    out.text(label);
    out.u32(values.len() as u32);
    out.u32(values.len() as u32);
    out.u32(0);
    out.numbers(values);
    out.finish()
}

/// Numbers in rows, the last axis first; axes have names.
pub(super) fn array(axes: &[(&str, usize)], values: &[f32]) -> Vec<u8> {
    let mut out = CdrWriter::new();
    out.u32(axes.len() as u32);
    for (k, (name, size)) in axes.iter().enumerate() {
        let stride: usize = axes[k..].iter().map(|(_, size)| size).product();
        out.text(name);
        out.u32(*size as u32);
        out.u32(stride as u32);
    }
    out.u32(0);
    out.u32(values.len() as u32);
    values.iter().for_each(|value| out.f32(*value));
    out.finish()
}

/// Lines in the world, one set for each name; a set without lines is taken away.
pub(super) fn lines(ns: u64, sets: &[(&str, Vec<[DVec3; 2]>)]) -> Vec<u8> {
    const LINE_LIST: u32 = 5;
    const ADD: u32 = 0;
    const DELETE: u32 = 2;
    let mut out = CdrWriter::new();
    out.u32(sets.len() as u32);
    for (name, lines) in sets {
        header(&mut out, ns, "world");
        out.text(name);
        [0, LINE_LIST, if lines.is_empty() { DELETE } else { ADD }].into_iter().for_each(|number| out.u32(number));
        // A pose that moves nothing; of the scale, the first number is the width.
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].into_iter().for_each(|number| out.f64(number));
        [LINE_WIDTH, 0.0, 0.0].into_iter().for_each(|number| out.f64(number));
        LINE_COLOUR.into_iter().for_each(|share| out.f32(share));
        // No end of its life, and no lock to its frame.
        out.time(0);
        out.u8(0);
        out.u32(2 * lines.len() as u32);
        lines.iter().flatten().for_each(|end| end.to_array().into_iter().for_each(|number| out.f64(number)));
        // No colours of points, no texture.
        out.u32(0);
        out.text("");
        header(&mut out, 0, "");
        out.text("");
        (0..2).for_each(|_| out.u32(0));
        // Neither text nor mesh.
        (0..3).for_each(|_| out.text(""));
        out.u32(0);
        out.u8(0);
    }
    out.finish()
}

/// Width (m) and colour (red, green, blue, opacity) of lines.
const LINE_WIDTH: f64 = 0.0008;
const LINE_COLOUR: [f32; 4] = [1.0, 0.55, 0.1, 1.0];

/// Poses of frames in the world.
pub(super) fn transforms(ns: u64, poses: &[(String, Pose)]) -> Vec<u8> {
    let mut out = CdrWriter::new();
    out.u32(poses.len() as u32);
    for (child, pose) in poses {
        header(&mut out, ns, "world");
        out.text(child);
        let (DVec3 { x, y, z }, DQuat { x: qx, y: qy, z: qz, w }) = (pose.position, pose.rotation);
        [x, y, z, qx, qy, qz, w].into_iter().for_each(|number| out.f64(number));
    }
    out.finish()
}

/// A text.
pub(super) fn text(text: &str) -> Vec<u8> {
    let mut out = CdrWriter::new();
    out.text(text);
    out.finish()
}

/// What a message holds.
#[derive(Debug, PartialEq)]
pub(super) struct Numbers {
    /// Time in its header (ns).
    pub(super) stamp_ns: Option<u64>,
    /// Its numbers with the ends of their channels' names.
    pub(super) values: Vec<(String, f64)>,
}

/// Numbers of a message; none where it holds other things or is malformed.
pub(super) fn read_numbers(kind: MessageKind, bytes: &[u8]) -> Option<Numbers> {
    let mut read = CdrReader::new(bytes)?;
    let mut stamp_ns = None;
    let mut header = |read: &mut CdrReader<'_>| {
        let (seconds, ns) = (read.u32()?, read.u32()?);
        stamp_ns = Some(u64::from(seconds) * 1_000_000_000 + u64::from(ns));
        read.text().map(drop)
    };
    let skip_layout = |read: &mut CdrReader<'_>| {
        for _ in 0..read.length(12)? {
            read.text()?;
            read.u32()?;
            read.u32()?;
        }
        read.u32().map(drop)
    };
    let counted = |values: Vec<f64>| values.into_iter().enumerate().map(|(k, v)| (format!("_{k}"), v)).collect();
    let one = |value: f64| vec![(String::new(), value)];
    let values = match kind {
        MessageKind::Number => one(read.f64()?),
        MessageKind::SmallNumber => one(f64::from(read.f32()?)),
        MessageKind::WholeNumber => one(f64::from(read.u32()?.cast_signed())),
        MessageKind::ShortNumber => one(f64::from(read.u16()?)),
        MessageKind::FluidPressure => {
            header(&mut read)?;
            one(read.f64()?)
        }
        MessageKind::Wrench => {
            header(&mut read)?;
            let axes = ["_force_x", "_force_y", "_force_z", "_torque_x", "_torque_y", "_torque_z"];
            axes.iter().map(|axis| Some(((*axis).to_owned(), read.f64()?))).collect::<Option<_>>()?
        }
        MessageKind::Numbers => {
            skip_layout(&mut read)?;
            counted(read.numbers()?)
        }
        MessageKind::SmallNumbers => {
            skip_layout(&mut read)?;
            counted(read.small_numbers()?)
        }
        MessageKind::JointState => {
            header(&mut read)?;
            let count = read.length(4)?;
            let names: Vec<&str> = (0..count).map(|_| read.text()).collect::<Option<_>>()?;
            let mut found = Vec::new();
            for suffix in ["", "_velocity", "_effort"] {
                let values = read.numbers()?;
                found.extend(names.iter().zip(values).map(|(name, value)| (format!("_{name}{suffix}"), value)));
            }
            found
        }
        MessageKind::Transforms | MessageKind::Markers | MessageKind::Text => return None,
    };
    Some(Numbers { stamp_ns, values })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_every_kind_read_back() {
        let names = ["left_1".to_owned(), "right_1".to_owned()];
        let read = |kind, bytes: &[u8]| read_numbers(kind, bytes).expect("numbers").values;
        let joints = read(MessageKind::JointState, &joint_state(3, &names, &[0.25, -1.0]));
        assert_eq!(joints, [("_left_1".to_owned(), 0.25), ("_right_1".to_owned(), -1.0)]);
        assert_eq!(read(MessageKind::FluidPressure, &fluid_pressure(3, 1e5)), [(String::new(), 1e5)]);
        let row = numbers("channels", [1.0, 2.0].into_iter());
        assert_eq!(read(MessageKind::Numbers, &row), [("_0".to_owned(), 1.0), ("_1".to_owned(), 2.0)]);
        assert!(read_numbers(MessageKind::Text, &text("a")).is_none());
        for cut in 0..row.len() {
            assert!(read_numbers(MessageKind::Numbers, &row[..cut]).is_none());
        }
    }

    #[test]
    fn definitions_name_every_type_that_they_use() {
        for kind in MessageKind::ALL {
            let text = kind.definition();
            assert_eq!(MessageKind::named(kind.name()), Some(kind));
            for used in
                ["std_msgs/Header ", "std_msgs/MultiArrayLayout ", "MultiArrayDimension[]", "TransformStamped[]"]
            {
                let name = used.trim_end_matches([' ', '[', ']']).rsplit('/').next().expect("a name");
                assert!(!text.contains(used) || text.contains(&format!("/{name}\n")), "{kind:?} lacks {name}");
            }
        }
    }
}
