//! Distance grids in files, so that an object is baked once and not by every process.

use super::{BakeError, Bounds, DistanceGrid, SolidPart, bake};
use glam::DVec3;
use std::hash::{BuildHasher as _, DefaultHasher, Hash, Hasher, RandomState};
use std::io;
use std::path::Path;

/// First bytes of a file. Another number marks grids of another layout or of another [`bake`].
const BEGINNING: [u8; 16] = *b"palpate grid 4\r\n";
/// Bytes before the distances: the beginning, a checksum of all that follows, ten numbers and three counts.
const HEADER: usize = BEGINNING.len() + 4 + 8 * 13;

/// Name for the grid of some solids with spacing `cell` (m): equal for equal solids.
fn grid_name(parts: &[SolidPart], cell: f64) -> String {
    let mut hasher = DefaultHasher::new();
    (BEGINNING, cell.to_bits(), parts.len()).hash(&mut hasher);
    for part in parts {
        match part {
            SolidPart::Primitive(shape, pose) => format!("{shape:?} {pose:?}").hash(&mut hasher),
            SolidPart::Mesh(mesh) => {
                mesh.points.iter().for_each(|p| p.to_array().map(f64::to_bits).hash(&mut hasher));
                mesh.triangles.hash(&mut hasher);
            }
        }
    }
    format!("{:016x}.grid", hasher.finish())
}

impl DistanceGrid {
    /// Encodes the grid, with a checksum.
    fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER + 4 * self.values.len());
        bytes.extend(BEGINNING);
        bytes.extend([0; 4]);
        let numbers = [self.origin, self.solid.min, self.solid.max].map(|p| p.to_array());
        numbers.as_flattened().iter().chain([&self.cell]).for_each(|x| bytes.extend(x.to_le_bytes()));
        self.size.iter().for_each(|n| bytes.extend((*n as u64).to_le_bytes()));
        self.values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        let checksum = crc32fast::hash(&bytes[BEGINNING.len() + 4..]);
        bytes[BEGINNING.len()..][..4].copy_from_slice(&checksum.to_le_bytes());
        bytes
    }

    /// Decodes a grid; `None` where the bytes are not those of a whole grid.
    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (checksum, content) = bytes.strip_prefix(&BEGINNING)?.split_first_chunk()?;
        if crc32fast::hash(content) != u32::from_le_bytes(*checksum) {
            return None;
        }
        let (header, values) = content.split_at_checked(HEADER - BEGINNING.len() - 4)?;
        let (words, _) = header.as_chunks::<8>();
        let point = |from: usize| DVec3::from_array([0, 1, 2].map(|k| f64::from_le_bytes(words[from + k])));
        let size = [10, 11, 12].map(|k| u64::from_le_bytes(words[k]) as usize);
        let nodes = size.iter().try_fold(1_usize, |product, n| product.checked_mul(*n))?;
        let values: Vec<f32> = values.as_chunks().0.iter().map(|value| f32::from_le_bytes(*value)).collect();
        let sound = nodes == values.len() && size.iter().all(|n| *n >= 2);
        let solid = Bounds { min: point(3), max: point(6) };
        sound.then(|| Self { origin: point(0), cell: f64::from_le_bytes(words[9]), size, values, solid })
    }
}

/// Bytes that a folder of grids may hold; the oldest are removed beyond.
const MOST_BYTES: u64 = 1 << 30;

/// [`bake`], or the grid of the same solids from a file in `folder`, where it is kept for the next time. A file that cannot be
/// read or is damaged is written anew; a folder that cannot be written costs only time.
pub fn bake_once(parts: &[SolidPart], cell: f64, folder: &Path) -> Result<DistanceGrid, BakeError> {
    let path = folder.join(grid_name(parts, cell));
    if let Some(grid) = std::fs::read(&path).ok().and_then(|bytes| DistanceGrid::from_bytes(&bytes)) {
        return Ok(grid);
    }
    let grid = bake(parts, cell)?;
    if let Err(cause) = keep(&path, folder, &grid.to_bytes()) {
        tracing::debug!("cannot keep the distances in {}: {cause}", path.display());
    }
    Ok(grid)
}

/// Writes a file that appears whole or not at all, under a temporary name that no other thread or process has.
fn keep(path: &Path, folder: &Path, bytes: &[u8]) -> io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let unfinished = path.with_extension(format!("{:016x}.unfinished", RandomState::new().hash_one(path)));
    let written = std::fs::write(&unfinished, bytes).and_then(|()| std::fs::rename(&unfinished, path));
    if written.is_err() {
        // Nothing more can be done about remains that cannot be removed.
        let _gone = std::fs::remove_file(&unfinished);
    }
    written.and_then(|()| remove_oldest(folder, MOST_BYTES))
}

/// Removes the grids that were written first until the folder holds at most so many bytes.
fn remove_oldest(folder: &Path, most: u64) -> io::Result<()> {
    let mut grids = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let about = entry.metadata()?;
        grids.push((about.modified()?, about.len(), entry.path()));
    }
    grids.sort();
    let mut held: u64 = grids.iter().map(|(_, bytes, _)| bytes).sum();
    for (_, bytes, path) in grids {
        if held <= most {
            break;
        }
        std::fs::remove_file(path)?;
        held -= bytes;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Pose, Primitive};

    fn two_balls(radius: f64) -> [SolidPart; 2] {
        let ball = Primitive::Sphere { radius };
        [SolidPart::Mesh(ball.tessellate()), SolidPart::Primitive(ball, Pose::from_position(DVec3::X * 0.01))]
    }

    #[test]
    fn a_grid_is_baked_once_and_a_damaged_file_is_not_used() -> io::Result<()> {
        let folder = tempfile::tempdir()?;
        let (parts, cell) = (two_balls(0.01), 2e-3);
        let once = || bake_once(&parts, cell, folder.path()).expect("bakes");
        let fresh = bake(&parts, cell).expect("bakes");
        assert_eq!(once(), fresh);
        // The file is read: another sound grid under its name is used, a damaged one is not.
        let path = folder.path().join(grid_name(&parts, cell));
        let other = bake(&two_balls(0.012), cell).expect("bakes");
        std::fs::write(&path, other.to_bytes())?;
        assert_eq!(once(), other);
        let bytes = fresh.to_bytes();
        for damaged in [&bytes[..bytes.len() - 4], &bytes[..30], &[], &[&bytes[..200], &[1], &bytes[201..]].concat()] {
            std::fs::write(&path, damaged)?;
            assert_eq!(once(), fresh);
            assert_eq!(std::fs::read(&path)?, bytes);
        }
        Ok(())
    }

    #[test]
    fn names_differ_where_grids_would() {
        let name = grid_name(&two_balls(0.01), 1e-3);
        assert_eq!(name, grid_name(&two_balls(0.01), 1e-3));
        assert_ne!(name, grid_name(&two_balls(0.01), 2e-3));
        assert_ne!(name, grid_name(&two_balls(0.011), 1e-3));
        assert_ne!(name, grid_name(&two_balls(0.01)[..1], 1e-3));
    }

    #[test]
    fn a_folder_that_cannot_be_written_costs_only_time_and_old_grids_go() -> io::Result<()> {
        let folder = tempfile::tempdir()?;
        let file = folder.path().join("file");
        std::fs::write(&file, [0; 10])?;
        assert_eq!(bake_once(&two_balls(0.01), 2e-3, &file), bake(&two_balls(0.01), 2e-3));
        let young = folder.path().join("young");
        std::fs::write(&young, [0; 10])?;
        std::fs::File::open(&file)?.set_modified(std::time::UNIX_EPOCH)?;
        remove_oldest(folder.path(), 20)?;
        assert!(file.exists());
        remove_oldest(folder.path(), 19)?;
        assert!(!file.exists() && young.exists());
        Ok(())
    }
}
