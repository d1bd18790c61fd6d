//! Raw frames as bytes. Little-endian, no padding, the same bytes for the same frames on every machine:
//!
//! ```text
//! magic "PPF1"            4 bytes
//! joints (both fingers)   u16
//! has object              u8      0 or 1
//! optional columns        u8      1 where the hand moves, plus 2 where fingers leave their planes; zero in all files of
//!                                 versions without these effects
//! frames                  u32
//! per frame:
//!   sample                u32
//!   t (s)                 f64
//!   line pressure (bar)   f64
//!   phase                 u8      0 close, 1 hold, 2 release
//!   joint angles (rad)    f64 x joints
//!   sways                 f64 x 4   left, right: curvature (1/m), twist (rad/m)   (only where fingers leave their planes)
//!   way of the hand (m)   f64 x 3                                       (only where the hand moves)
//!   object in the world   f64 x 7   x y z (m), quaternion x y z w       (only where has object is 1)
//!   loaded taxels         u16
//!   per taxel:            u16 taxel, f32 normal, f32 along, f32 across (N)
//! ```

use glam::{DQuat, DVec3};
use palpate_geometry::Pose;
use palpate_sim::frame::{Frame, TaxelLoad};
use palpate_sim::gripper::{Phase, Sway};

const MAGIC: &[u8; 4] = b"PPF1";
const HEADER: usize = 12;
/// Optional columns.
const HAND_MOVES: u8 = 1;
const FINGERS_SWAY: u8 = 2;

/// Error of decoding frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BlobError {
    #[error("its frames have an unknown format")]
    Magic,
    #[error("its frames end in the middle of frame {frame}")]
    CutShort {
        /// Number of the frame.
        frame: u32,
    },
    #[error("frame {frame} holds an invalid value")]
    BadValue {
        /// Number of the frame.
        frame: u32,
    },
}

/// Encodes frames that all have the same number of joints and the same presence of an object.
pub fn encode_frames(frames: &[Frame]) -> Vec<u8> {
    let joints = frames.first().map_or(0, |f| f.q.len());
    let has_object = frames.first().is_some_and(|f| f.world_from_object.is_some());
    let mut out = Vec::new();
    out.extend_from_slice(MAGIC);
    out.extend_from_slice(&(joints as u16).to_le_bytes());
    let hand_moves = frames.iter().any(|f| f.hand != DVec3::ZERO);
    let sway = frames.iter().any(|f| f.sways != [Sway::NONE; 2]);
    let optional = u8::from(hand_moves) * HAND_MOVES + u8::from(sway) * FINGERS_SWAY;
    out.extend_from_slice(&[u8::from(has_object), optional]);
    out.extend_from_slice(&(frames.len() as u32).to_le_bytes());
    for frame in frames {
        assert_eq!(frame.q.len(), joints, "all frames of a trial have the same joints");
        out.extend_from_slice(&frame.sample.to_le_bytes());
        out.extend_from_slice(&frame.t.to_le_bytes());
        out.extend_from_slice(&frame.line_bar.to_le_bytes());
        out.push(phase_code(frame.phase));
        for q in &frame.q {
            out.extend_from_slice(&q.to_le_bytes());
        }
        if sway {
            for x in frame.sways.map(Sway::to_array).concat() {
                out.extend_from_slice(&x.to_le_bytes());
            }
        }
        if hand_moves {
            for x in frame.hand.to_array() {
                out.extend_from_slice(&x.to_le_bytes());
            }
        }
        if has_object {
            let pose = frame.world_from_object.unwrap_or_default();
            let numbers = pose.position.to_array().into_iter().chain(pose.rotation.to_array());
            for x in numbers {
                out.extend_from_slice(&x.to_le_bytes());
            }
        }
        out.extend_from_slice(&(frame.taxels.len() as u16).to_le_bytes());
        for load in &frame.taxels {
            out.extend_from_slice(&load.taxel.to_le_bytes());
            for x in [load.normal, load.along, load.across] {
                out.extend_from_slice(&x.to_le_bytes());
            }
        }
    }
    out
}

/// Decodes frames; allocates no more than the bytes hold.
pub fn decode_frames(bytes: &[u8]) -> Result<Vec<Frame>, BlobError> {
    let mut reader = Reader { bytes, at: 0, frame: 0 };
    if reader.take::<4>().ok() != Some(*MAGIC) || bytes.len() < HEADER {
        return Err(BlobError::Magic);
    }
    let joints = usize::from(u16::from_le_bytes(reader.take()?));
    let [has_object, optional] = reader.take()?;
    let count = u32::from_le_bytes(reader.take()?);
    if has_object > 1 || optional > HAND_MOVES + FINGERS_SWAY {
        return Err(BlobError::Magic);
    }
    let mut frames = Vec::new();
    for index in 0..count {
        reader.frame = index;
        frames.push(reader.frame(joints, has_object == 1, optional)?);
    }
    if reader.at == bytes.len() { Ok(frames) } else { Err(BlobError::BadValue { frame: count }) }
}

fn phase_code(phase: Phase) -> u8 {
    match phase {
        Phase::Close => 0,
        Phase::Hold => 1,
        Phase::Release => 2,
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    frame: u32,
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], BlobError> {
        let end = self.at + N;
        let slice = self.bytes.get(self.at..end).ok_or(BlobError::CutShort { frame: self.frame })?;
        self.at = end;
        let mut array = [0; N];
        array.copy_from_slice(slice);
        Ok(array)
    }

    /// A finite number.
    fn number(&mut self) -> Result<f64, BlobError> {
        let x = f64::from_le_bytes(self.take()?);
        if x.is_finite() { Ok(x) } else { Err(self.bad()) }
    }

    fn small_number(&mut self) -> Result<f32, BlobError> {
        let x = f32::from_le_bytes(self.take()?);
        if x.is_finite() { Ok(x) } else { Err(self.bad()) }
    }

    fn bad(&self) -> BlobError {
        BlobError::BadValue { frame: self.frame }
    }

    fn frame(&mut self, joints: usize, has_object: bool, optional: u8) -> Result<Frame, BlobError> {
        let sample = u32::from_le_bytes(self.take()?);
        let (t, line_bar) = (self.number()?, self.number()?);
        let [code] = self.take()?;
        let phase = match code {
            0 => Phase::Close,
            1 => Phase::Hold,
            2 => Phase::Release,
            _ => return Err(self.bad()),
        };
        let q = (0..joints).map(|_| self.number()).collect::<Result<_, _>>()?;
        let sways = if optional & FINGERS_SWAY != 0 { [self.sway()?, self.sway()?] } else { [Sway::NONE; 2] };
        let hand_moves = optional & HAND_MOVES != 0;
        let hand = if hand_moves { DVec3::new(self.number()?, self.number()?, self.number()?) } else { DVec3::ZERO };
        let world_from_object = if has_object { Some(self.pose()?) } else { None };
        let count = u16::from_le_bytes(self.take()?);
        let mut taxels = Vec::new();
        for _ in 0..count {
            taxels.push(TaxelLoad {
                taxel: u16::from_le_bytes(self.take()?),
                normal: self.small_number()?,
                along: self.small_number()?,
                across: self.small_number()?,
            });
        }
        Ok(Frame { sample, t, line_bar, phase, q, sways, hand, world_from_object, taxels })
    }

    fn sway(&mut self) -> Result<Sway, BlobError> {
        Ok(Sway { curvature: self.number()?, twist: self.number()? })
    }

    fn pose(&mut self) -> Result<Pose, BlobError> {
        let position = DVec3::new(self.number()?, self.number()?, self.number()?);
        let rotation = DQuat::from_xyzw(self.number()?, self.number()?, self.number()?, self.number()?);
        if rotation.length_squared() < 0.5 {
            return Err(self.bad());
        }
        Ok(Pose { position, rotation })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_trials::grasp;
    use palpate_geometry::Primitive;
    use palpate_sim::objects::ObjectModel;
    use palpate_sim::scene::Scene;
    use proptest::prelude::*;

    fn frames() -> Vec<Frame> {
        let mut scene = Scene::default();
        scene.timing.duration_s = 2.0;
        let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
        grasp(&scene, Some(&ball), 0).data.frames
    }

    #[test]
    fn frames_survive_a_round_trip() {
        let frames = frames();
        assert!(frames.iter().any(|f| !f.taxels.is_empty()));
        assert!(decode_frames(&encode_frames(&frames)) == Ok(frames));
        assert_eq!(decode_frames(&encode_frames(&[])), Ok(vec![]));
    }

    #[test]
    fn sideways_shapes_survive_and_cost_nothing_where_there_are_none() {
        let planar = frames();
        let mut swayed = planar.clone();
        swayed[7].sways[1] = Sway { curvature: -0.25, twist: 1.5 };
        swayed[9].hand = DVec3::new(0.0, 1e-3, 0.0);
        let bytes = encode_frames(&swayed);
        assert_eq!(bytes.len(), encode_frames(&planar).len() + planar.len() * 7 * 8);
        assert!(decode_frames(&bytes) == Ok(swayed));
    }

    #[test]
    fn every_cut_is_noticed() {
        let bytes = encode_frames(&frames()[..3]);
        for end in 0..bytes.len() {
            assert!(decode_frames(&bytes[..end]).is_err(), "{end}");
        }
        let longer = [bytes, vec![0]].concat();
        assert!(decode_frames(&longer).is_err());
    }

    proptest! {
        #[test]
        fn damaged_bytes_never_panic(at in 0usize..2000, value: u8, noise: Vec<u8>) {
            let mut bytes = encode_frames(&frames()[140..145]);
            let at = at % bytes.len();
            bytes[at] = value;
            // Any outcome but a panic.
            let _outcome = decode_frames(&bytes);
            prop_assert!(decode_frames(&noise).is_err());
        }
    }
}
