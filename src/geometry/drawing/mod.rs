//! The draw list: shapes, camera and labels as plain data. Made without a graphics card, drawn by any renderer.
//!
//! World coordinates in metres, z up. Overlay coordinates in points from the top left corner; a point is a pixel on an
//! ordinary screen.

mod axis;
mod camera;
mod figure;
mod heat_map;
mod overlay;

pub use axis::PlotAxis;
pub use camera::{Camera, PictureRoom, StandardView};
pub use figure::{DataPoint, DataSeries, Figure, LineStyle, Marker, Plot, ReferenceLine, SpreadBand};
pub use heat_map::{CellAxis, ColourScale, HeatMap};
pub use overlay::{Align, Overlay, Shape2};

use crate::SurfaceMesh;
use crate::palette::Rgb;
use glam::{Mat4, Vec2, Vec3};
use std::sync::Arc;

/// Everything in one picture.
#[derive(Clone, Debug)]
pub struct DrawList {
    /// From where it is seen.
    pub camera: Camera,
    /// Backdrop colours, above and below.
    pub backdrop: [Rgb; 2],
    /// Ball that holds everything which casts a shadow: centre and radius (m).
    pub shadow_bounds: (Vec3, f32),
    /// The ground and its grid.
    pub ground: Option<Ground>,
    /// Rigid things.
    pub solids: Vec<Solid>,
    /// Things shown for comparison: translucent, without shadow.
    pub ghosts: Vec<Solid>,
    pub fingers: Vec<SoftFinger>,
    /// Forces.
    pub arrows: Vec<Arrow>,
    /// Flat shapes and text on top.
    pub overlay: Overlay,
    /// How finely light is computed.
    pub detail: Detail,
    /// Picture within the picture.
    pub inset: Option<Box<Inset>>,
}

/// Picture within a picture: the same moment from another side, or an earlier one.
#[derive(Clone, Debug)]
pub struct Inset {
    /// What is in it; its overlay begins at its own corner.
    pub list: DrawList,
    /// Its upper left corner in the picture (points).
    pub corner: Vec2,
    /// Width and height (points).
    pub size: Vec2,
    /// Number of the earlier moment that it shows. It has shadows of its own, and is drawn again only for another number.
    pub past: Option<u64>,
}

/// How finely the light of a picture is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Detail {
    /// As finely as it is worth looking at.
    #[default]
    Full,
    /// Shadows with harder edges, for pictures that move on a slow rasteriser.
    Fast,
}

/// The ground, level with z = `height`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Its height (m).
    pub height: f32,
    pub colour: Rgb,
    /// Colour of the grid: a line every 10 mm, a stronger one every 50 mm.
    pub grid: Rgb,
    /// Radius at which it has faded into the backdrop (m).
    pub radius: f32,
}

/// Rigid mesh with its pose in the world.
#[derive(Clone, Debug)]
pub struct Solid {
    /// Its surface; the same `Arc` in the next picture means that nothing has to be uploaded again.
    pub mesh: Arc<SurfaceMesh>,
    /// Its place.
    pub world_from_mesh: Mat4,
    /// Colour in place of the mesh's own.
    pub tint: Option<Rgb>,
}

/// A soft finger as a smooth skin over a chain of frames.
#[derive(Clone, Debug, PartialEq)]
pub struct SoftFinger {
    /// Frames along the neutral axis, from palm to tip.
    pub frames: Vec<FingerFrame>,
    /// Cross-section.
    pub section: Section,
    /// Loads on the pad.
    pub taxels: TaxelField,
    /// Pressure that has the brightest colour (Pa).
    pub full_scale: f32,
    /// Stretch that is drawn translucent.
    pub veil: Veil,
    /// Sensors that are drawn on it.
    pub sensors: FingerSensors,
}

/// Sensors of a finger: strips along its back, and the outlines of its pads.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FingerSensors {
    /// Flex strips; at most two are drawn.
    pub strips: Vec<SensorStrip>,
    /// Pads of equal length that divide the finger; none are drawn for zero.
    pub pads: u32,
    /// Colours of the pads on the half next to the palm, and on that with the tip.
    pub pad_colours: [Rgb; 2],
}

/// Flex strip on the back of a finger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorStrip {
    /// Where it begins and ends, along the neutral axis from the palm (m).
    pub stretch: [f32; 2],
    pub colour: Rgb,
}

/// Translucent stretch of a finger, behind which the face of its pad is seen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Veil {
    /// Where it begins and ends along the neutral axis (m).
    pub stretch: [f32; 2],
    /// 0: opaque, 1: as clear as it gets.
    pub clearness: f32,
}

/// A place on the neutral axis of a finger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerFrame {
    /// Arc length from the palm (m).
    pub arc: f32,
    /// Position (m).
    pub position: Vec3,
    /// Unit vector towards the tip.
    pub along: Vec3,
    /// Unit vector out of the pad.
    pub inward: Vec3,
}

/// Cross-section of a finger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// Width across the bending plane (m).
    pub width: f32,
    /// Height of the pad in front of the neutral axis (m).
    pub pad: f32,
    /// Radius of the pad's crown (m).
    pub crown_radius: f32,
    /// Depth of the bellows behind the neutral axis (m).
    pub back: f32,
}

/// Loads on a pad, row by row from palm to tip.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TaxelField {
    /// Rows along the finger.
    pub rows: u32,
    /// Columns across it.
    pub columns: u32,
    /// For each taxel its pressure (Pa) and how far it is pushed in (m).
    pub loads: Vec<[f32; 2]>,
}

/// An arrow, for a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrow {
    /// Start (m).
    pub from: Vec3,
    /// Tip (m).
    pub to: Vec3,
    /// Radius of the shaft (m).
    pub radius: f32,
    pub colour: Rgb,
}
