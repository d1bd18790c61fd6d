//! Text STL, as exporters really write it: keywords in any case and spelling, normals that are no numbers, several solids,
//! any line ends.

use super::obj_text::{brief, no_number};
use crate::TriMesh;
use glam::DVec3;

/// Bytes at the beginning in which a text STL names its first facet.
const HEAD: usize = 2000;

/// True for a text STL, false for a binary one, whose header may begin with the same word.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(HEAD)];
    let text = String::from_utf8_lossy(head.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(head)).to_ascii_lowercase();
    let begins = super::lines(&text).map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'));
    let is_solid = begins.is_some_and(|line| line.starts_with("solid") || line.starts_with("facet"));
    is_solid
        && !head.contains(&0)
        && (text.contains("facet") || text.contains("endsolid") || text.contains("end solid"))
}

/// The triangles of all solids of a file; the error is a sentence with the line.
pub(super) fn parse(bytes: &[u8]) -> Result<TriMesh, String> {
    let text = String::from_utf8_lossy(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes));
    let mut mesh = TriMesh::default();
    let mut last = 0;
    for (number, line) in (1..).zip(super::lines(&text)) {
        let mut words = line.split_whitespace();
        let Some(word) = words.next() else { continue };
        last = number;
        match word.to_ascii_lowercase().as_str() {
            "vertex" => {
                let mut place = [0.0; 3];
                for value in &mut place {
                    let text = words
                        .next()
                        .ok_or_else(|| format!("line {number}: the corner has fewer than three numbers"))?;
                    let read = text.parse::<f32>().map_err(|_| format!("line {number}: {}", no_number(text)))?;
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
    if mesh.points.len() % 3 != 0 {
        return Err(format!("it ends inside a facet, at line {last}; the file is cut short"));
    }
    mesh.triangles = (0..mesh.points.len() as u32 / 3).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    Ok(mesh)
}

fn check_facet(mesh: &TriMesh, number: usize) -> Result<(), String> {
    if mesh.points.len() % 3 == 0 {
        return Ok(());
    }
    Err(format!("line {number}: the facet that ends here does not have three corners"))
}
