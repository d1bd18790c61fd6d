//! Figures as SVG and as pixels, drawn by plotters' backends from a [`Figure`].
//!
//! Both are drawn from the same layout on a grid of quarter points. Text uses the font that the window ships, so that no
//! font has to be installed; an SVG names it, and falls back to a usual one.

mod canvas;
mod labels;
mod layout;

use crate::Picture;
use canvas::{Canvas, SUBPIXELS, TextMetrics};
use palpate_geometry::drawing::Figure;
use palpate_geometry::palette::Theme;
use plotters::prelude::{BitMapBackend, SVGBackend};

/// Error of drawing a figure.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// A drawing backend failed.
    #[error("the figure cannot be drawn: {cause}")]
    Backend {
        /// Message of the backend.
        cause: String,
    },
}

/// Draws a figure as SVG, `size` points wide and high.
pub fn figure_svg(figure: &Figure, theme: Theme, size: [u32; 2]) -> Result<String, FigureError> {
    let mut svg = String::new();
    let [width, height] = size.map(|side| side * SUBPIXELS);
    {
        let mut canvas = Canvas::new(SVGBackend::with_string(&mut svg, (width, height)), theme, TextMetrics::SVG)?;
        layout::draw(&mut canvas, figure, size.map(f64::from))?;
        canvas.finish()?;
    }
    // Drawn in quarter points, shown in points.
    let drawn = format!("width=\"{width}\" height=\"{height}\"");
    Ok(svg.replacen(&drawn, &format!("width=\"{}\" height=\"{}\"", size[0], size[1]), 1))
}

/// Draws a figure `size` points wide and high, with two pixels per point.
pub fn figure_picture(figure: &Figure, theme: Theme, size: [u32; 2]) -> Result<Picture, FigureError> {
    let [width, height] = size.map(|side| side * SUBPIXELS);
    let mut fine = vec![0; (width * height * 3) as usize];
    {
        let backend = BitMapBackend::with_buffer(&mut fine, (width, height));
        let mut canvas = Canvas::new(backend, theme, TextMetrics::BITMAP)?;
        layout::draw(&mut canvas, figure, size.map(f64::from))?;
        canvas.finish()?;
    }
    Ok(halved(&fine, width as usize, height as usize))
}

/// Means of blocks of two by two pixels (RGB in, RGBA out): the backend does not smooth thick lines.
fn halved(fine: &[u8], width: usize, height: usize) -> Picture {
    let mut rgba = Vec::with_capacity(width * height);
    for y in 0..height / 2 {
        for x in 0..width / 2 {
            for channel in 0..3 {
                let at = |dx: usize, dy: usize| u32::from(fine[((2 * y + dy) * width + 2 * x + dx) * 3 + channel]);
                rgba.push(((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) + 2) / 4) as u8);
            }
            rgba.push(255);
        }
    }
    Picture { width: (width / 2) as u32, height: (height / 2) as u32, rgba }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::drawing::{DataPoint, DataSeries, LineStyle, Marker, Plot, PlotAxis};

    fn figure() -> Figure {
        let points = (0..5).map(|n| DataPoint { label: format!("point {n}"), ..DataPoint::new(10f64.powi(n), 1.0) });
        let series = DataSeries {
            name: "a <b>".to_owned(),
            line: LineStyle::Bold,
            marker: Marker::Dot,
            points: points.collect(),
            ..DataSeries::default()
        };
        let plot = Plot {
            title: "Left".to_owned(),
            x: PlotAxis::logarithmic("cost (ms)"),
            y: PlotAxis::linear("error"),
            series: vec![series],
            references: Vec::new(),
        };
        Figure { title: "Two plots".to_owned(), plots: vec![plot.clone(), plot], columns: 0, note: "a note".to_owned() }
    }

    #[test]
    fn svg_has_all_texts_and_is_the_same_every_time() -> Result<(), FigureError> {
        let svg = figure_svg(&figure(), Theme::Light, [600, 300])?;
        for text in ["Two plots", "Left", "cost (ms)", "a &lt;b&gt;", "a note", "point 4", "1000"] {
            assert!(svg.contains(text), "{text} is missing in {svg}");
        }
        assert!(svg.starts_with("<svg width=\"600\" height=\"300\" viewBox=\"0 0 2400 1200\""), "{}", &svg[..80]);
        assert_eq!(svg, figure_svg(&figure(), Theme::Light, [600, 300])?);
        Ok(())
    }

    #[test]
    fn pixels_have_the_theme_s_background_and_the_series_colour() -> Result<(), FigureError> {
        for theme in Theme::ALL {
            let picture = figure_picture(&figure(), theme, [600, 300])?;
            assert_eq!((picture.width, picture.height, picture.rgba.len()), (1200, 600, 1200 * 600 * 4));
            let count = |colour: palpate_geometry::palette::Rgb| {
                picture.rgba.chunks_exact(4).filter(|p| p[..3] == [colour.0, colour.1, colour.2]).count()
            };
            assert!(count(theme.colours().background) > 500_000);
            assert!(count(palpate_geometry::palette::series_colour(0, theme)) > 2000);
        }
        Ok(())
    }

    #[test]
    fn figures_without_points_and_narrow_figures_can_be_drawn() -> Result<(), FigureError> {
        figure_svg(&Figure::default(), Theme::Light, [200, 100])?;
        let mut empty = figure();
        empty.plots[0].series.clear();
        figure_picture(&empty, Theme::Dark, [80, 60])?;
        Ok(())
    }
}
