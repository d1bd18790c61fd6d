//! Golden pictures: `screenshots/NAME.png`. `UPDATE_SCREENSHOTS=1 cargo test --test suite` makes them anew; look at them
//! before committing.

use image::RgbaImage;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use std::path::{Path, PathBuf};

/// A pixel counts as different beyond this step in any channel. Software rasterisers of one kind agree to 1 or 2.
const STEP: u8 = 2;
/// So many pixels may differ: two software rasterisers were seen to differ in 88 of a million.
const MOST_DIFFERENT: usize = 150;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("screenshots")
}

fn differing(a: &RgbaImage, b: &RgbaImage) -> usize {
    a.pixels().zip(b.pixels()).filter(|(p, q)| (0..4).any(|k| p.0[k].abs_diff(q.0[k]) > STEP)).count()
}

/// Writes a picture as small as PNG can: without its opacity, which is full everywhere.
fn save(picture: &RgbaImage, path: &Path) {
    let opaque = image::DynamicImage::ImageRgba8(picture.clone()).into_rgb8();
    // Plain colours are smallest without a filter, shaded ones with.
    let encoded = [FilterType::NoFilter, FilterType::Adaptive].map(|filter| {
        let mut bytes = Vec::new();
        opaque.write_with_encoder(PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, filter)).unwrap();
        bytes
    });
    std::fs::write(path, encoded.into_iter().min_by_key(Vec::len).unwrap()).unwrap();
}

/// Pictures in columns, row by row; each has the room of the largest.
pub(crate) fn sheet(pictures: &[RgbaImage], columns: u32) -> RgbaImage {
    let largest = |side: fn(&RgbaImage) -> u32| pictures.iter().map(side).max().unwrap_or(1);
    let (width, height) = (largest(RgbaImage::width), largest(RgbaImage::height));
    let rows = (pictures.len() as u32).div_ceil(columns);
    let grey = image::Rgba([128, 128, 128, 255]);
    let mut sheet = RgbaImage::from_pixel(columns * width, rows * height, grey);
    for (k, picture) in pictures.iter().enumerate() {
        let (column, row) = (k as u32 % columns, k as u32 / columns);
        image::imageops::replace(&mut sheet, picture, i64::from(column * width), i64::from(row * height));
    }
    sheet
}

/// Compares a picture with the golden one, or makes that. `drawn_by` is named when they differ.
pub(crate) fn compare(name: &str, picture: &RgbaImage, drawn_by: &str) {
    let path = folder().join(format!("{name}.png"));
    if std::env::var_os("UPDATE_SCREENSHOTS").is_some() {
        let same = image::open(&path).is_ok_and(|old| {
            let old = old.into_rgba8();
            old.dimensions() == picture.dimensions() && differing(&old, picture) == 0
        });
        if !same {
            save(picture, &path);
        }
        return;
    }
    let golden = match image::open(&path) {
        Ok(golden) => golden.into_rgba8(),
        Err(error) => panic!("{}: {error}; make it with UPDATE_SCREENSHOTS=1 cargo test --test suite", path.display()),
    };
    let different =
        if golden.dimensions() == picture.dimensions() { differing(&golden, picture) } else { picture.pixels().len() };
    if different > MOST_DIFFERENT {
        let failed = folder().join("failed");
        std::fs::create_dir_all(&failed).unwrap();
        let seen = failed.join(format!("{name}.png"));
        picture.save(&seen).unwrap();
        panic!(
            "{name}: {different} pixels differ (drawn by {drawn_by}). Compare {} with {}. Golden pictures come from \
             Mesa's software rasteriser; on a machine with another OpenGL driver set LIBGL_ALWAYS_SOFTWARE=1",
            seen.display(),
            path.display()
        );
    }
}

#[test]
fn pictures_differ_where_they_differ() {
    let plain = RgbaImage::from_pixel(10, 10, image::Rgba([100, 100, 100, 255]));
    let mut other = plain.clone();
    other.put_pixel(3, 4, image::Rgba([100, 102, 100, 255]));
    assert_eq!(differing(&plain, &other), 0);
    other.put_pixel(5, 6, image::Rgba([100, 103, 100, 255]));
    assert_eq!(differing(&plain, &other), 1);
}
