//! Movies of pictures: animated PNG and GIF, written picture by picture, so that memory does not grow with their length.
//! Only the rectangle that differs from the previous picture is written.

use crate::Picture;
use std::io::Write;

/// Format of a movie in one file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MovieFormat {
    /// Animated PNG: all colours.
    Apng,
    /// GIF: 256 colours per picture, times in hundredths of a second.
    Gif,
}

/// Error of writing a movie.
#[derive(Debug, thiserror::Error)]
pub enum MovieError {
    #[error("the movie cannot be written: {cause}")]
    Encode {
        /// Message of the encoder.
        cause: String,
    },
    #[error("a picture of the movie is {found:?} pixels instead of {wanted:?}")]
    Size {
        /// Its width and height (pixels).
        found: [u32; 2],
        /// Those of the movie.
        wanted: [u32; 2],
    },
    #[error("a GIF is at most 65535 pixels wide and high, not {0:?}")]
    TooLarge([u32; 2]),
}

/// Writes a movie, one picture after the other.
pub struct MovieWriter<W: Write> {
    encoder: Encoder<W>,
    size: [u32; 2],
    /// Hundredths of a second of all pictures so far, and the exact time.
    shown: (u64, f64),
    /// Time of each picture (s).
    each_s: f64,
    /// Pixels of the picture before; empty before the first.
    before: Vec<u8>,
}

/// Rectangle of a picture (pixels).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Region {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
}

impl Region {
    /// The smallest rectangle around all pixels that differ, or one pixel if none does. The whole first picture.
    fn changed(before: &[u8], now: &[u8], [width, height]: [u32; 2]) -> Self {
        if before.len() != now.len() {
            return Self { x: 0, y: 0, width, height };
        }
        let pixels = before.chunks_exact(4).zip(now.chunks_exact(4)).enumerate();
        let differing = pixels.filter(|(_, (a, b))| a != b).map(|(k, _)| [k as u32 % width, k as u32 / width]);
        let (low, high) = differing.fold(([width, height], [0; 2]), |(low, high), at| {
            ([0, 1].map(|k: usize| at[k].min(low[k])), [0, 1].map(|k: usize| at[k].max(high[k])))
        });
        if low[0] > high[0] {
            return Self { x: 0, y: 0, width: 1, height: 1 };
        }
        Self { x: low[0], y: low[1], width: high[0] - low[0] + 1, height: high[1] - low[1] + 1 }
    }

    /// Places of its pixels in a picture so wide, row by row.
    fn places(self, width: u32) -> impl Iterator<Item = usize> {
        let rows = self.y..self.y + self.height;
        rows.flat_map(move |y| (self.x..self.x + self.width).map(move |x| (y * width + x) as usize))
    }
}

enum Encoder<W: Write> {
    Apng(png::Writer<W>),
    Gif(gif::Encoder<W>),
}

fn failed(cause: impl std::fmt::Display) -> MovieError {
    MovieError::Encode { cause: cause.to_string() }
}

impl<W: Write> MovieWriter<W> {
    /// Begins a movie of so many pictures at a rate (1/s), which is shown over and over.
    pub fn new(
        out: W,
        format: MovieFormat,
        size: [u32; 2],
        pictures: u32,
        pictures_per_s: f64,
    ) -> Result<Self, MovieError> {
        let encoder = match format {
            MovieFormat::Apng => {
                let mut encoder = png::Encoder::new(out, size[0], size[1]);
                encoder.set_color(png::ColorType::Rgb);
                encoder.set_animated(pictures, 0).map_err(failed)?;
                let thousandths = (1000.0 / pictures_per_s).round().clamp(1.0, 65535.0) as u16;
                encoder.set_frame_delay(thousandths, 1000).map_err(failed)?;
                Encoder::Apng(encoder.write_header().map_err(failed)?)
            }
            MovieFormat::Gif => {
                let [width, height] = size.map(u16::try_from);
                let (Ok(width), Ok(height)) = (width, height) else { return Err(MovieError::TooLarge(size)) };
                let mut encoder = gif::Encoder::new(out, width, height, &[]).map_err(failed)?;
                encoder.set_repeat(gif::Repeat::Infinite).map_err(failed)?;
                Encoder::Gif(encoder)
            }
        };
        Ok(Self { encoder, size, shown: (0, 0.0), each_s: 1.0 / pictures_per_s, before: Vec::new() })
    }

    /// Adds a picture, without its opacity.
    pub fn add(&mut self, picture: &Picture) -> Result<(), MovieError> {
        let found = [picture.width, picture.height];
        if found != self.size {
            return Err(MovieError::Size { found, wanted: self.size });
        }
        let region = Region::changed(&self.before, &picture.rgba, self.size);
        let pixel = |at: usize| &picture.rgba[4 * at..4 * at + 4];
        match &mut self.encoder {
            Encoder::Apng(writer) => {
                let rgb: Vec<u8> = region.places(self.size[0]).flat_map(|at| &pixel(at)[..3]).copied().collect();
                // The first picture is whole, and says so itself.
                if !self.before.is_empty() {
                    writer.reset_frame_position().map_err(failed)?;
                    writer.set_frame_dimension(region.width, region.height).map_err(failed)?;
                    writer.set_frame_position(region.x, region.y).map_err(failed)?;
                }
                writer.write_image_data(&rgb).map_err(failed)?;
            }
            Encoder::Gif(encoder) => {
                let known = |at: usize| self.before.get(4 * at..4 * at + 4) == Some(pixel(at));
                // A pixel that stays is clear, which packs well.
                let clear =
                    |at: usize| if known(at) { [0; 4] } else { [pixel(at)[0], pixel(at)[1], pixel(at)[2], 255] };
                let mut rgba: Vec<u8> = region.places(self.size[0]).flat_map(clear).collect();
                let [x, y, width, height] = [region.x, region.y, region.width, region.height].map(|side| side as u16);
                let mut frame = gif::Frame::from_rgba_speed(width, height, &mut rgba, SPEED);
                (frame.left, frame.top, frame.dispose) = (x, y, gif::DisposalMethod::Keep);
                // Rounding errors do not add up over the movie.
                self.shown.1 += 100.0 * self.each_s;
                let delay = (self.shown.1.round() as u64).saturating_sub(self.shown.0).max(1);
                self.shown.0 += delay;
                frame.delay = delay.min(65535) as u16;
                encoder.write_frame(&frame).map_err(failed)?;
            }
        }
        self.before.clone_from(&picture.rgba);
        Ok(())
    }

    /// Ends the movie.
    pub fn finish(self) -> Result<(), MovieError> {
        match self.encoder {
            Encoder::Apng(writer) => writer.finish().map_err(failed),
            Encoder::Gif(encoder) => encoder.into_inner().map_err(failed)?.flush().map_err(failed),
        }
    }
}

/// Thoroughness of choosing a GIF's colours: 1 is best, 30 fastest.
const SPEED: i32 = 3;

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(shade: u8) -> Picture {
        let rgba = (0..40 * 30).flat_map(|n| [shade, (n % 40) as u8, 90, 255]).collect();
        Picture { width: 40, height: 30, rgba }
    }

    #[test]
    fn an_animated_png_holds_every_picture_exactly() -> Result<(), Box<dyn std::error::Error>> {
        let mut bytes = Vec::new();
        let mut movie = MovieWriter::new(&mut bytes, MovieFormat::Apng, [40, 30], 3, 25.0)?;
        for shade in [10, 100, 200] {
            movie.add(&picture(shade))?;
        }
        let odd = Picture { width: 41, ..picture(0) };
        assert!(matches!(movie.add(&odd), Err(MovieError::Size { found: [41, 30], wanted: [40, 30] })));
        movie.finish()?;
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info()?;
        let control = reader.info().animation_control.ok_or("not animated")?;
        assert_eq!((control.num_frames, control.num_plays), (3, 0));
        for shade in [10, 100, 200] {
            let mut rgb = vec![0; 40 * 30 * 3];
            reader.next_frame(&mut rgb)?;
            let wanted: Vec<u8> = picture(shade).rgba.chunks_exact(4).flat_map(|p| p[..3].to_vec()).collect();
            assert_eq!(rgb, wanted);
            let frame = reader.info().frame_control.ok_or("no times")?;
            assert_eq!((frame.delay_num, frame.delay_den), (40, 1000));
        }
        Ok(())
    }

    #[test]
    fn only_what_changed_is_written() -> Result<(), Box<dyn std::error::Error>> {
        let mut moved = picture(10);
        for (x, y) in [(5, 7), (9, 8)] {
            moved.rgba[4 * (40 * y + x)] = 99;
        }
        let (first, size) = (picture(10), [40, 30]);
        assert_eq!(Region::changed(&[], &first.rgba, size), Region { x: 0, y: 0, width: 40, height: 30 });
        let part = Region { x: 5, y: 7, width: 5, height: 2 };
        assert_eq!(Region::changed(&first.rgba, &moved.rgba, size), part);
        assert_eq!(Region::changed(&moved.rgba, &moved.rgba, size), Region { x: 0, y: 0, width: 1, height: 1 });
        for format in [MovieFormat::Apng, MovieFormat::Gif] {
            let mut bytes = Vec::new();
            let mut movie = MovieWriter::new(&mut bytes, format, size, 4, 10.0)?;
            for picture in [&first, &moved, &moved, &first] {
                movie.add(picture)?;
            }
            movie.finish()?;
            let places = match format {
                MovieFormat::Apng => {
                    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info()?;
                    let mut places = Vec::new();
                    for _ in 0..4 {
                        reader.next_frame(&mut vec![0; 40 * 30 * 3])?;
                        let frame = reader.info().frame_control.ok_or("no place")?;
                        places.push([frame.x_offset, frame.y_offset, frame.width, frame.height]);
                    }
                    places
                }
                MovieFormat::Gif => {
                    let mut decoder = gif::DecodeOptions::new().read_info(&bytes[..])?;
                    let mut places = Vec::new();
                    while let Some(frame) = decoder.read_next_frame()? {
                        places.push([frame.left, frame.top, frame.width, frame.height].map(u32::from));
                    }
                    places
                }
            };
            assert_eq!(places, [[0, 0, 40, 30], [5, 7, 5, 2], [0, 0, 1, 1], [5, 7, 5, 2]], "{format:?}");
        }
        Ok(())
    }

    #[test]
    fn a_gif_keeps_its_time() -> Result<(), Box<dyn std::error::Error>> {
        let mut bytes = Vec::new();
        let mut movie = MovieWriter::new(&mut bytes, MovieFormat::Gif, [40, 30], 30, 30.0)?;
        for shade in 0..30 {
            movie.add(&picture(shade * 8))?;
        }
        movie.finish()?;
        let mut decoder = gif::DecodeOptions::new().read_info(&bytes[..])?;
        let mut delays = Vec::new();
        while let Some(frame) = decoder.read_next_frame()? {
            delays.push(frame.delay);
        }
        assert_eq!((delays.len(), delays.iter().sum::<u16>()), (30, 100), "{delays:?}");
        assert!(matches!(
            MovieWriter::new(Vec::new(), MovieFormat::Gif, [70_000, 30], 1, 30.0),
            Err(MovieError::TooLarge(_))
        ));
        Ok(())
    }
}
