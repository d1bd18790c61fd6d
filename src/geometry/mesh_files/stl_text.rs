//! Text STL, as exporters really write it: keywords in any case and spelling, normals that are no numbers, several solids,
//! any line ends.

use super::obj_text::{brief, no_number};
use crate::TriMesh;
use glam::DVec3;

/// Bytes at the beginning in which a text STL names its first facet.
const HEAD: usize = 2000;

/// True for a text STL, false for a binary one, whose header may begin with the same word.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    let text = crate::file::text_of(&bytes[..bytes.len().min(HEAD) & !1]).to_ascii_lowercase();
    let mut words = super::lines(&text).filter_map(|line| line.split_whitespace().next());
    !text.contains('\0') && words.any(|word| ["facet", "endsolid", "end"].contains(&word))
}

/// The triangles of all solids of a file; the error is a sentence with the line.
pub(super) fn parse(bytes: &[u8]) -> Result<TriMesh, String> {
    let text = crate::file::text_of(bytes);
    let mut mesh = TriMesh::default();
    // Remarks may stand above the first solid.
    let (mut last, mut begun) = (0, false);
    for (number, line) in (1..).zip(super::lines(&text)) {
        let mut words = line.split_whitespace();
        let Some(word) = words.next() else { continue };
        last = number;
        let word = word.to_ascii_lowercase();
        begun |= ["solid", "facet"].contains(&word.as_str());
        match word.as_str() {
            _ if !begun => {}
            "vertex" => {
                let mut place = [0.0; 3];
                for value in &mut place {
                    let text = words
                        .next()
                        .ok_or_else(|| format!("line {number}: the corner has fewer than three numbers"))?;
                    let read = text.parse::<f32>().map_err(|_none| format!("line {number}: {}", no_number(text)))?;
                    if !read.is_finite() {
                        return Err(format!("line {number}: \"{}\" is no place of a corner", brief(text)));
                    }
                    *value = f64::from(read);
                }
                mesh.points.push(DVec3::from_array(place));
            }
            "endfacet" => check_facet(&mesh, number)?,
            "end" if words.next().is_some_and(|what| what.eq_ignore_ascii_case("facet")) => check_facet(&mesh, number)?,
            "solid" | "facet" | "outer" | "endloop" | "endsolid" | "end" | "color" | "#" => {}
            other if other.starts_with('#') => {}
            _ => return Err(format!("line {number}: \"{}\" is no line of a text STL", brief(line.trim()))),
        }
    }
    if !mesh.points.len().is_multiple_of(3) {
        return Err(format!("it ends inside a facet, at line {last}; the file is cut short"));
    }
    mesh.triangles = (0..mesh.points.len() as u32 / 3).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    Ok(mesh)
}

fn check_facet(mesh: &TriMesh, number: usize) -> Result<(), String> {
    if mesh.points.len().is_multiple_of(3) {
        return Ok(());
    }
    Err(format!("line {number}: the facet that ends here does not have three corners"))
}
