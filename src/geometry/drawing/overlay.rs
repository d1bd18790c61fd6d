//! Flat shapes and text drawn over the picture, in points from the top left corner.

use crate::palette::Rgb;
use glam::Vec2;

/// Two-dimensional marks over the picture, drawn in this order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overlay {
    /// Shapes; later ones cover earlier ones.
    pub shapes: Vec<Shape2>,
}

/// Horizontal alignment of a text at its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Its left end.
    Left,
    /// Its middle.
    Centre,
    /// Its right end.
    Right,
}

/// A flat shape.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape2 {
    /// A line of some width with an opacity.
    Line {
        /// One end.
        from: Vec2,
        /// The other.
        to: Vec2,
        /// Width in points.
        width: f32,
        colour: Rgb,
        /// 0 invisible to 1 opaque.
        opacity: f32,
    },
    /// A filled rectangle.
    Rectangle {
        /// Top left corner.
        min: Vec2,
        /// Bottom right corner.
        max: Vec2,
        /// Colours at the left and right end; they blend in between.
        colours: [Rgb; 2],
        /// 0 invisible to 1 opaque.
        opacity: f32,
    },
    /// A filled disc.
    Disc {
        /// Middle.
        centre: Vec2,
        /// Radius in points.
        radius: f32,
        colour: Rgb,
    },
    /// A line of text, centred vertically on its position.
    Text {
        /// Position.
        at: Vec2,
        /// Alignment.
        align: Align,
        /// Height of the font in points.
        size: f32,
        colour: Rgb,
        text: String,
    },
}

impl Overlay {
    /// Adds an opaque line.
    pub fn line(&mut self, from: Vec2, to: Vec2, width: f32, colour: Rgb) {
        self.shapes.push(Shape2::Line { from, to, width, colour, opacity: 1.0 });
    }

    /// Adds a text.
    pub fn text(&mut self, at: Vec2, align: Align, size: f32, colour: Rgb, text: impl Into<String>) {
        self.shapes.push(Shape2::Text { at, align, size, colour, text: text.into() });
    }
}
