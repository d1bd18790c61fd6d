//! Figures as SVG and as pixels, drawn by plotters' backends from a [`Figure`].
//!
//! Both are drawn from the same layout on a grid of quarter points. Text uses the font that the window ships, so that no
//! font has to be installed; an SVG names it, and falls back to a usual one.

mod areas;
mod canvas;
mod frame;
mod labels;
mod layout;

pub use labels::{PlacedLabel, placed_labels};

use crate::Picture;
use canvas::{Canvas, SUBPIXELS, TextMetrics};
use palpate_geometry::drawing::Figure;
use palpate_geometry::palette::Theme;
use plotters::prelude::{BitMapBackend, SVGBackend};

/// Error of drawing a figure.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
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
    use palpate_geometry::drawing::{
        CellAxis, ColourScale, DataPoint, DataSeries, HeatMap, LineStyle, Marker, Plot, PlotAxis, SpreadBand,
    };
    use palpate_geometry::palette::Rgb;

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
            ..Plot::default()
        };
        Figure {
            title: "Two plots".to_owned(),
            plots: vec![plot.clone(), plot],
            note: "a note".to_owned(),
            ..Figure::default()
        }
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
    fn cells_fill_the_axes_in_the_colours_of_their_values() -> Result<(), FigureError> {
        let axis = |name: &str, count: usize, range: [f64; 2]| CellAxis {
            name: name.to_owned(),
            unit: String::new(),
            count,
            range,
        };
        let heat = HeatMap {
            title: "left".to_owned(),
            quantity: "pressure".to_owned(),
            unit: "kPa".to_owned(),
            x: axis("time", 3, [0.0, 3.0]),
            y: axis("row", 2, [0.5, 2.5]),
            values: vec![0.5, 0.7, 1.0, 1.0, f32::NAN, 0.5],
            scale: ColourScale::Load(1.0),
        };
        let figure = Figure { plots: vec![Plot::of_heat_map(heat.clone())], ..Figure::default() };
        for theme in Theme::ALL {
            let picture = figure_picture(&figure, theme, [400, 200])?;
            let places = |wanted: Option<Rgb>| {
                let Rgb(r, g, b) = wanted.expect("a colour");
                let found = picture.rgba.chunks_exact(4).enumerate().filter(move |(_, p)| p[..3] == [r, g, b]);
                found.map(|(place, _)| place / picture.width as usize).collect::<Vec<usize>>()
            };
            let [middle, bright] = [0.5, 1.0].map(|value| places(heat.scale.colour(value)));
            assert!(middle.len() > 5000 && bright.len() > 5000, "{} {}", middle.len(), bright.len());
            assert!(middle.len().abs_diff(bright.len()) < middle.len() / 10, "two cells each");
            // Only the first row has a value of 0.7, and it is the upper one.
            let upper = places(heat.scale.colour(0.7));
            assert!(upper.iter().max() < bright.iter().max(), "rows count down");
        }
        assert!(figure_svg(&figure, Theme::Light, [400, 200])?.contains("pressure (kPa)"));
        Ok(())
    }

    #[test]
    fn a_line_ends_where_a_number_is_missing_and_a_band_is_filled() -> Result<(), FigureError> {
        let points = (0..90).map(|n| DataPoint::new(f64::from(n), if n == 45 { f64::NAN } else { 1.0 }));
        let series = DataSeries { line: LineStyle::Thin, points: points.collect(), ..DataSeries::default() };
        let dashed = DataSeries { line: LineStyle::Dashed, colour: 1, ..series.clone() };
        let band = SpreadBand { colour: 2, points: (0..9).map(|n| [f64::from(n), 0.0, 2.0]).collect() };
        let count = |plot: Plot, tag: &str| -> Result<usize, FigureError> {
            let figure = Figure { plots: vec![plot], ..Figure::default() };
            Ok(figure_svg(&figure, Theme::Dark, [600, 300])?.matches(tag).count())
        };
        assert_eq!(count(Plot { series: vec![series], ..Plot::default() }, "<polyline")?, 2);
        assert!(count(Plot { series: vec![dashed], ..Plot::default() }, "<polyline")? > 20);
        assert_eq!(count(Plot { bands: vec![band], ..Plot::default() }, "<polygon")?, 1);
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
