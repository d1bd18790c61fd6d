//! Lines, signs and text in points, on any backend of plotters.

use super::FigureError;
use palpate_geometry::drawing::{Align, LineStyle, Marker};
use palpate_geometry::palette::{Rgb, Theme, ThemeColours};
use plotters::prelude::{DrawingBackend, FontStyle, IntoFont, RGBColor, ShapeStyle, TextStyle};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, register_font};
use std::fmt::Display;

/// Units of a backend's grid per point.
pub(super) const SUBPIXELS: u32 = 4;
/// Fonts of text, the first of which is the shipped one.
const FONT: &str = "Ubuntu, Helvetica, Arial, sans-serif";

/// Radius of a marker, and width of a thin curve (points).
pub(super) const RADIUS: f64 = 3.25;
pub(super) const CURVE: f64 = 1.25;

/// Width of a line (points); none where there is no line.
pub(super) fn line_width(line: LineStyle) -> Option<f64> {
    match line {
        LineStyle::None => None,
        LineStyle::Thin | LineStyle::Dashed => Some(CURVE),
        LineStyle::Bold => Some(3.0),
    }
}

/// How a backend places text.
#[derive(Clone, Copy, Debug)]
pub(super) struct TextMetrics {
    /// Its font size per em.
    per_em: f64,
    /// Depth of the baseline below the top of a text, as a share of its font size.
    baseline: f64,
    /// Whether lines through many points are one element.
    polylines: bool,
}

impl TextMetrics {
    /// plotters-svg writes an em of the size over 1.24, 0.76 em below the top.
    pub(super) const SVG: Self = Self { per_em: 1.24, baseline: 0.76 / 1.24, polylines: true };
    /// ab_glyph scales by ascent plus descent, and plotters draws the baseline at half the size.
    pub(super) const BITMAP: Self = Self { per_em: 1.15, baseline: 0.5, polylines: false };
}

/// A text to be drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Text<'a> {
    pub(super) text: &'a str,
    /// Anchor on the baseline (points).
    pub(super) at: [f64; 2],
    pub(super) align: Align,
    /// Size of an em (points).
    pub(super) size: f64,
    pub(super) colour: Rgb,
}

pub(super) struct Canvas<B> {
    backend: B,
    text: TextMetrics,
    pub(super) colours: ThemeColours,
    pub(super) theme: Theme,
}

fn failed(cause: impl Display) -> FigureError {
    FigureError::Backend { cause: cause.to_string() }
}

impl<B: DrawingBackend> Canvas<B> {
    /// A canvas filled with the theme's background.
    pub(super) fn new(mut backend: B, theme: Theme, text: TextMetrics) -> Result<Self, FigureError> {
        register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
            .map_err(|_font| failed("the font that the program ships cannot be read"))?;
        backend.ensure_prepared().map_err(failed)?;
        let (width, height) = backend.get_size();
        let colours = theme.colours();
        let corner = (width as i32, height as i32);
        backend.draw_rect((0, 0), corner, &style(colours.background, 1.0).filled(), true).map_err(failed)?;
        Ok(Self { backend, text, colours, theme })
    }

    pub(super) fn finish(mut self) -> Result<(), FigureError> {
        self.backend.present().map_err(failed)
    }

    /// Straight pieces through points, with round corners.
    pub(super) fn path(&mut self, points: &[[f64; 2]], width: f64, colour: Rgb) -> Result<(), FigureError> {
        let style = style(colour, width);
        for pair in points.windows(2) {
            self.backend.draw_line(grid(pair[0]), grid(pair[1]), &style).map_err(failed)?;
        }
        if width > 1.5 {
            for point in points {
                self.disc(*point, width / 2.0, colour)?;
            }
        }
        Ok(())
    }

    /// A line through many points.
    pub(super) fn curve(&mut self, points: &[[f64; 2]], width: f64, colour: Rgb) -> Result<(), FigureError> {
        if !self.text.polylines || points.len() < 2 {
            return self.path(points, width, colour);
        }
        self.backend.draw_path(points.iter().copied().map(grid), &style(colour, width)).map_err(failed)
    }

    /// A polygon, filled with a translucent colour.
    pub(super) fn veil(&mut self, outline: &[[f64; 2]], colour: Rgb, opacity: f64) -> Result<(), FigureError> {
        let style = style(colour, 1.0).color.mix(opacity);
        self.backend.fill_polygon(outline.iter().copied().map(grid), &style).map_err(failed)
    }

    pub(super) fn rectangle(&mut self, [low, high]: [[f64; 2]; 2], colour: Rgb) -> Result<(), FigureError> {
        self.backend.draw_rect(grid(low), grid(high), &style(colour, 1.0).filled(), true).map_err(failed)
    }

    fn disc(&mut self, at: [f64; 2], radius: f64, colour: Rgb) -> Result<(), FigureError> {
        self.backend.draw_circle(grid(at), units(radius), &style(colour, 1.0).filled(), true).map_err(failed)
    }

    /// A sign, `radius` points from its centre to its edge.
    pub(super) fn marker(&mut self, marker: Marker, at: [f64; 2], radius: f64, colour: Rgb) -> Result<(), FigureError> {
        let [x, y] = at;
        match marker {
            Marker::None => Ok(()),
            Marker::Dot => self.disc(at, radius, colour),
            Marker::Ring => {
                self.disc(at, radius, colour)?;
                self.disc(at, radius - 1.25, self.colours.background)
            }
            Marker::Square => {
                let half = radius * 0.9;
                self.rectangle([[x - half, y - half], [x + half, y + half]], colour)
            }
            Marker::Cross => {
                self.path(&[[x - radius, y - radius], [x + radius, y + radius]], 1.5, colour)?;
                self.path(&[[x - radius, y + radius], [x + radius, y - radius]], 1.5, colour)
            }
        }
    }

    pub(super) fn text(&mut self, text: &Text<'_>) -> Result<(), FigureError> {
        let size = text.size * self.text.per_em;
        let anchor = match text.align {
            Align::Left => HPos::Left,
            Align::Centre => HPos::Center,
            Align::Right => HPos::Right,
        };
        let position = Pos::new(anchor, VPos::Top);
        let font = (FONT, size * f64::from(SUBPIXELS)).into_font();
        let Rgb(r, g, b) = text.colour;
        let colour = RGBColor(r, g, b);
        let style = TextStyle::from(font).color(&colour).pos(position);
        let top = [text.at[0], text.at[1] - self.text.baseline * size];
        self.backend.draw_text(text.text, &style, grid(top)).map_err(failed)
    }

    /// Width of a text (points), with room for another font of an SVG.
    pub(super) fn width(&self, text: &str, size: f64) -> Result<f64, FigureError> {
        let size = size * TextMetrics::BITMAP.per_em * f64::from(SUBPIXELS);
        let (low, high) = (FONT, size).into_font().layout_box(text).map_err(failed)?;
        Ok(1.05 * f64::from(high.0 - low.0) / f64::from(SUBPIXELS))
    }
}

fn style(colour: Rgb, width: f64) -> ShapeStyle {
    let Rgb(r, g, b) = colour;
    ShapeStyle { color: RGBColor(r, g, b).into(), filled: false, stroke_width: units(width) }
}

fn units(points: f64) -> u32 {
    (points * f64::from(SUBPIXELS)).round().max(1.0) as u32
}

fn grid(at: [f64; 2]) -> (i32, i32) {
    let [x, y] = at.map(|c| (c * f64::from(SUBPIXELS)).round() as i32);
    (x, y)
}
