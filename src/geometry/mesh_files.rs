//! Meshes from and to files: OBJ with its materials through tobj, STL (binary or text) through stl_io.

use super::{Finish, TriMesh};
use crate::palette::Rgb;
use glam::DVec3;
use std::io::Cursor;
use std::path::Path;

/// Files larger than this are refused before they are parsed (bytes): some five million triangles.
const LARGEST_FILE: usize = 256 << 20;

/// Triangles beyond this are refused: drawing and baking would take minutes.
const MOST_TRIANGLES: usize = 2_000_000;

/// Part of a mesh file that shares one material.
#[derive(Clone, Debug)]
pub struct ColouredPart {
    /// The triangles.
    pub mesh: TriMesh,
    /// The material's diffuse colour where the file names one.
    pub colour: Option<Rgb>,
    /// The material's finish, by its name.
    pub finish: Finish,
}

/// Reason why a mesh file cannot be used, as a sentence.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct MeshFileError(String);

impl MeshFileError {
    /// A file that cannot be opened.
    pub fn unreadable(name: &str, cause: impl std::fmt::Display) -> Self {
        Self(format!("cannot read the mesh \"{name}\": {cause}"))
    }
}

/// Reads `name` through `read`, which returns a file's bytes given its path relative to wherever `name` lives, so
/// that embedded and real files are read alike. A missing material file only costs the colours.
pub fn read_mesh(
    name: &str,
    read: &dyn Fn(&str) -> std::io::Result<Vec<u8>>,
) -> Result<Vec<ColouredPart>, MeshFileError> {
    let extension = Path::new(name).extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    if extension != "obj" && extension != "stl" {
        let kind = if extension.is_empty() { "typeless".to_owned() } else { format!(".{extension}") };
        return Err(MeshFileError(format!(
            "\"{name}\" is a {kind} file; Palpate reads meshes from .obj and .stl (export it as one of these)"
        )));
    }
    let bytes = read(name).map_err(|cause| MeshFileError::unreadable(name, cause))?;
    if bytes.len() > LARGEST_FILE {
        return Err(too_large(name, bytes.len() >> 20, "MiB", LARGEST_FILE >> 20));
    }
    let parts = if extension == "obj" {
        parse_obj(name, &bytes, read)?
    } else {
        vec![ColouredPart { mesh: parse_stl(name, bytes)?, colour: None, finish: Finish::default() }]
    };
    let triangles: usize = parts.iter().map(|p| p.mesh.triangles.len()).sum();
    if triangles > MOST_TRIANGLES {
        return Err(too_large(name, triangles, "triangles", MOST_TRIANGLES));
    }
    Ok(parts)
}

fn too_large(name: &str, found: usize, unit: &str, limit: usize) -> MeshFileError {
    MeshFileError(format!(
        "the mesh \"{name}\" is too large: {found} {unit}, the limit is {limit}; reduce it in a modelling tool"
    ))
}

fn damaged(name: &str, cause: &dyn std::fmt::Display) -> MeshFileError {
    MeshFileError(format!("the mesh \"{name}\" is damaged: {cause}"))
}

fn parse_obj(
    name: &str,
    bytes: &[u8],
    read: &dyn Fn(&str) -> std::io::Result<Vec<u8>>,
) -> Result<Vec<ColouredPart>, MeshFileError> {
    let options = tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, single_index: false };
    let folder = Path::new(name).parent().unwrap_or(Path::new(""));
    let load_materials = |file: &Path| {
        let path = folder.join(file);
        match path.to_str().map(read) {
            Some(Ok(text)) => tobj::load_mtl_buf(&mut Cursor::new(text)),
            _ => Err(tobj::LoadError::OpenFileFailed),
        }
    };
    let (models, materials) =
        tobj::load_obj_buf(&mut Cursor::new(bytes), &options, load_materials).map_err(|e| damaged(name, &e))?;
    let materials = match materials {
        Ok(materials) => materials,
        Err(error) => {
            tracing::debug!("{name}: no materials ({error})");
            Vec::new()
        }
    };
    let part = |model: tobj::Model| -> Result<ColouredPart, MeshFileError> {
        let mesh = model.mesh;
        if !mesh.indices.len().is_multiple_of(3) || !mesh.positions.len().is_multiple_of(3) {
            return Err(damaged(name, &"a face has fewer than three corners"));
        }
        let material = mesh.material_id.and_then(|id| materials.get(id));
        Ok(ColouredPart {
            mesh: TriMesh {
                points: mesh.positions.as_chunks::<3>().0.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect(),
                triangles: mesh.indices.as_chunks::<3>().0.to_vec(),
            },
            colour: material.and_then(|material| material.diffuse).map(Rgb::from_unit),
            finish: material.map_or_else(Finish::default, |material| Finish::of_material(&material.name)),
        })
    };
    models.into_iter().map(part).collect()
}

fn parse_stl(name: &str, mut bytes: Vec<u8>) -> Result<TriMesh, MeshFileError> {
    // A binary file announces its count; trust it only when the bytes are there. Its header may start with "solid" too.
    let announced = bytes.get(80..84).map(|n| u32::from_le_bytes([n[0], n[1], n[2], n[3]]) as usize);
    let expected = announced.map(|n| 84 + 50 * n);
    let looks_like_text = bytes.trim_ascii_start().starts_with(b"solid") && expected != Some(bytes.len());
    if !looks_like_text && expected.is_none_or(|expected| expected > bytes.len()) {
        let cause = match announced {
            Some(n) => format!("it announces {n} triangles but ends after {} bytes", bytes.len()),
            None => "it ends before the triangle count".to_owned(),
        };
        return Err(damaged(name, &cause));
    }
    // The reader detects the kind from the beginning of the file, and stops at the end of the first solid.
    if looks_like_text {
        bytes = as_one_solid(&String::from_utf8_lossy(&bytes));
    } else if let Some(first) = bytes.first_mut() {
        *first = 0;
    }
    let mut reader = Cursor::new(bytes);
    let mesh = stl_io::read_stl(&mut reader).map_err(|e| damaged(name, &e))?;
    Ok(TriMesh {
        points: mesh.vertices.iter().map(|v| DVec3::from_array(<[f32; 3]>::from(*v).map(f64::from))).collect(),
        triangles: mesh.faces.iter().map(|f| f.vertices.map(|i| i as u32)).collect(),
    })
}

/// A text STL whose solids are one, with the header that the reader expects.
fn as_one_solid(text: &str) -> Vec<u8> {
    let mut one = String::from("solid all\n");
    for line in text.lines().map(str::trim) {
        if !line.starts_with("solid") && !line.starts_with("endsolid") {
            one.push_str(line);
            one.push('\n');
        }
    }
    one.push_str("endsolid all\n");
    one.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Primitive;

    fn in_memory(files: Vec<(&'static str, Vec<u8>)>) -> impl Fn(&str) -> std::io::Result<Vec<u8>> {
        move |path| {
            let found = files.iter().find(|(name, _)| *name == path);
            found.map(|(_, bytes)| bytes.clone()).ok_or_else(|| std::io::Error::from(std::io::ErrorKind::NotFound))
        }
    }

    #[test]
    fn an_obj_is_read_with_its_material() {
        let mesh = Primitive::Cuboid { half: DVec3::new(0.01, 0.02, 0.03) }.tessellate();
        let points = mesh.points.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z));
        let faces = mesh.triangles.iter().map(|t| t.map(|i| i + 1)).map(|[a, b, c]| format!("f {a} {b} {c}\n"));
        let obj: String = ["mtllib cube.mtl\nusemtl red\n".to_owned()].into_iter().chain(points).chain(faces).collect();
        let read = in_memory(vec![("d/cube.obj", obj.into()), ("d/cube.mtl", "newmtl red\nKd 1 0.2 0\n".into())]);
        let parts = read_mesh("d/cube.obj", &read).expect("readable");
        assert_eq!(parts.len(), 1);
        assert_eq!(parts[0].colour, Some(Rgb(255, 51, 0)));
        let corners = |m: &TriMesh| m.triangles.iter().map(|t| m.corners(*t)).collect::<Vec<_>>();
        for (got, want) in corners(&parts[0].mesh).iter().zip(corners(&mesh)) {
            assert!((0..3).all(|i| got[i].abs_diff_eq(want[i], 1e-9)));
        }
    }

    #[test]
    fn a_missing_material_file_costs_only_the_colour() {
        let text = "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl x\nf 1 2 3\n";
        let parts = read_mesh("a.obj", &in_memory(vec![("a.obj", text.into())])).expect("readable");
        assert_eq!((parts.len(), parts[0].colour), (1, None));
    }

    #[test]
    fn a_binary_stl_that_lies_about_its_length_is_damaged() {
        let mut bytes = vec![0; 84];
        bytes[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
        let result = read_mesh("a.stl", &in_memory(vec![("a.stl", bytes)]));
        assert!(result.is_err_and(|error| error.to_string().contains("is damaged")));
    }

    #[test]
    fn stl_is_read_in_all_its_forms() {
        let facet = |z: f32| {
            format!(
                "facet normal 0 0 1\nouter loop\nvertex 0 0 {z}\nvertex 1 0 {z}\nvertex 0 1 {z}\nendloop\nendfacet\n"
            )
        };
        let count =
            |bytes: Vec<u8>| read_mesh("a.stl", &in_memory(vec![("a.stl", bytes)])).map(|p| p[0].mesh.triangles.len());
        let two = format!("solid a\n{}endsolid a\nsolid b\n{}endsolid b\n", facet(0.0), facet(1.0));
        assert_eq!(count(two.into_bytes()).expect("two solids"), 2);
        assert_eq!(count(format!("\n  solid\n{}endsolid", facet(0.0)).into_bytes()).expect("no name"), 1);
        let mut binary = b"solid by some exporter\n".to_vec();
        binary.resize(80, b' ');
        binary.extend(1u32.to_le_bytes());
        binary.extend([0; 50]);
        assert_eq!(count(binary).expect("binary"), 1);
        assert!(count(format!("solid a\n{}", &facet(0.0)[..40]).into_bytes()).is_err(), "cut short");
    }

    #[test]
    fn other_formats_are_refused_by_name() {
        let result = read_mesh("robot.dae", &in_memory(vec![]));
        let text = result.err().map(|e| e.to_string()).unwrap_or_default();
        assert!(text.contains(".dae") && text.contains(".obj"), "{text}");
    }
}
