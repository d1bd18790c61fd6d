//! Meshes from files: OBJ with its materials through tobj, binary STL through stl_io, text STL.

mod obj_text;
mod stl_text;

use crate::file::other_content;
use crate::palette::Rgb;
use crate::{Finish, TriMesh};
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
    if let Some(what) = other_content(&bytes) {
        return Err(MeshFileError::unreadable(name, what));
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
    let options =
        tobj::LoadOptions { triangulate: false, ignore_points: true, ignore_lines: true, single_index: false };
    let folder = Path::new(name).parent().unwrap_or(Path::new(""));
    let load_materials = |file: &Path| {
        let path = folder.join(file);
        match path.to_str().map(read) {
            Some(Ok(text)) => tobj::load_mtl_buf(&mut Cursor::new(text)),
            _ => Err(tobj::LoadError::OpenFileFailed),
        }
    };
    let text = obj_text::cleaned(bytes).map_err(|cause| damaged(name, &cause))?;
    let (models, materials) =
        tobj::load_obj_buf(&mut Cursor::new(text), &options, load_materials).map_err(|e| damaged(name, &e))?;
    let materials = match materials {
        Ok(materials) => materials,
        Err(error) => {
            tracing::debug!("{name}: no materials ({error})");
            Vec::new()
        }
    };
    let part = |model: tobj::Model| {
        let mesh = model.mesh;
        let points: Vec<DVec3> =
            mesh.positions.as_chunks::<3>().0.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
        let mut triangles = Vec::with_capacity(mesh.indices.len() / 3);
        // Without arities, all faces are triangles.
        let arities = mesh.face_arities.iter().map(|arity| *arity as usize).chain(std::iter::repeat(3));
        let mut rest = mesh.indices.as_slice();
        for arity in arities {
            let Some((polygon, others)) = rest.split_at_checked(arity) else { break };
            triangulated(&points, polygon, &mut triangles);
            rest = others;
        }
        let material = mesh.material_id.and_then(|id| materials.get(id));
        ColouredPart {
            mesh: TriMesh { points, triangles },
            colour: material.and_then(|material| material.diffuse).map(Rgb::from_unit),
            finish: material.map_or_else(Finish::default, |material| Finish::of_material(&material.name)),
        }
    };
    Ok(models.into_iter().map(part).collect())
}

/// The triangles of a polygon with these corners: a fan where it is convex, else as it lies in its plane.
fn triangulated(points: &[DVec3], polygon: &[u32], triangles: &mut Vec<[u32; 3]>) {
    let corners: Vec<DVec3> = polygon.iter().map(|corner| points[*corner as usize]).collect();
    let beside = |k: usize| (corners[k], corners[(k + 1) % corners.len()]);
    // Newell's normal, which needs no flat polygon.
    let normal = (0..corners.len()).map(beside).map(|(a, b)| (a - corners[0]).cross(b - corners[0])).sum::<DVec3>();
    let turn = |k: usize| {
        let ((a, b), (_, c)) = (beside(k), beside((k + 1) % corners.len()));
        (b - a).cross(c - b).dot(normal)
    };
    let fan = |triangles: &mut Vec<[u32; 3]>| {
        triangles.extend(polygon[1..].windows(2).map(|pair| [polygon[0], pair[0], pair[1]]));
    };
    if polygon.len() < 3 {
        return;
    }
    if polygon.len() == 3 || (0..corners.len()).all(|k| turn(k) >= 0.0) {
        return fan(triangles);
    }
    let across = normal.any_orthonormal_vector();
    let (x, y) = (across, normal.normalize_or_zero().cross(across));
    let flat: Vec<[f64; 2]> = corners.iter().map(|p| [p.dot(x), p.dot(y)]).collect();
    let mut found: Vec<u32> = Vec::new();
    earcut::Earcut::new().earcut_slice(&flat, &[], &mut found);
    // A polygon that crosses itself has no triangulation.
    if found.len() != 3 * (polygon.len() - 2) {
        return fan(triangles);
    }
    triangles.extend(found.as_chunks::<3>().0.iter().map(|t| oriented(*t, &flat).map(|k| polygon[k as usize])));
}

/// A triangle of a plane, walked to the left.
fn oriented([a, b, c]: [u32; 3], flat: &[[f64; 2]]) -> [u32; 3] {
    let [p, q, r] = [a, b, c].map(|k| flat[k as usize]);
    let area = (q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1]);
    if area < 0.0 { [a, c, b] } else { [a, b, c] }
}

fn parse_stl(name: &str, mut bytes: Vec<u8>) -> Result<TriMesh, MeshFileError> {
    if stl_text::is_text(&bytes) {
        return stl_text::parse(&bytes).map_err(|cause| damaged(name, &cause));
    }
    // A binary file announces its count; trust it only when the bytes are there.
    let announced = bytes.get(80..84).map(|n| u32::from_le_bytes([n[0], n[1], n[2], n[3]]) as usize);
    let Some(announced) = announced else { return Err(damaged(name, &"it ends before the triangle count")) };
    let (there, rest) = ((bytes.len() - 84) / 50, (bytes.len() - 84) % 50);
    if announced > there {
        let cause = format!(
            "it announces {announced} triangles but ends after {} bytes, which hold {there}; the file is cut short, or its \
             count is wrong",
            bytes.len()
        );
        return Err(damaged(name, &cause));
    }
    // Exporters put remarks behind the last facet, but no whole facets.
    if announced < there && rest == 0 {
        let cause = format!("its header announces {announced} triangles, but {there} follow; one of the two is wrong");
        return Err(damaged(name, &cause));
    }
    // The reader detects the kind from the beginning of the file.
    bytes[0] = 0;
    let mesh = stl_io::read_stl(&mut Cursor::new(without_normals(bytes))).map_err(|e| damaged(name, &e))?;
    Ok(TriMesh {
        points: mesh.vertices.iter().map(|v| DVec3::from_array(<[f32; 3]>::from(*v).map(f64::from))).collect(),
        triangles: mesh.faces.iter().map(|f| f.vertices.map(|i| i as u32)).collect(),
    })
}

/// A binary STL with normals of zero: they follow from the corners, and may be no numbers.
fn without_normals(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes[84..].chunks_mut(50).for_each(|facet| facet.iter_mut().take(12).for_each(|byte| *byte = 0));
    bytes
}

/// Lines of a text with any line ends.
fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.split('\n').flat_map(|line| line.strip_suffix('\r').unwrap_or(line).split('\r'))
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
        assert!(count(format!("solid a\n{}", &facet(0.0)[..60]).into_bytes()).is_err(), "cut short");
    }

    fn read_text(name: &'static str, text: &str) -> Result<TriMesh, String> {
        let read = in_memory(vec![(name, text.as_bytes().to_vec())]);
        read_mesh(name, &read).map(|mut parts| parts.remove(0).mesh).map_err(|error| error.to_string())
    }

    fn corners_of(mesh: &TriMesh) -> Vec<[DVec3; 3]> {
        mesh.triangles.iter().map(|t| mesh.corners(*t)).collect()
    }

    const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

    #[test]
    fn an_obj_is_the_same_however_it_is_written() {
        let plain = corners_of(&read_text("a.obj", TETRAHEDRON).expect("plain"));
        let others = [
            format!("\u{feff}{TETRAHEDRON}"),
            TETRAHEDRON.replace('\n', "\r\n"),
            TETRAHEDRON.replace('\n', "\r"),
            TETRAHEDRON.replace("f 1 3 2", "f 1 \\\n3 2"),
            TETRAHEDRON.replace("f 1 3 2", "f 1 3 2 # the bottom, m\u{fc}de"),
            TETRAHEDRON.replace("v 1 0 0", "v 1 0 0 0.5 0.5 0.5 # red"),
            TETRAHEDRON.replace("f 1 3 2", "f 1/ 3/ 2/"),
            TETRAHEDRON.replace("f 1 3 2", "fo 1 3 2"),
            TETRAHEDRON.to_uppercase(),
            TETRAHEDRON.replace("f 1 3 2", "f -4//-1 -2 -3"),
            format!("usemtl\nl 1 2 3 4 1\np 1\nvn nan 0 0\ng\n{TETRAHEDRON}s off\ncstype bezier\n"),
        ];
        for text in others {
            let mesh = read_text("a.obj", &text).unwrap_or_else(|error| panic!("{error}: {text}"));
            assert_eq!(corners_of(&mesh), plain, "{text}");
        }
        let latin = [b"# gr\xfc\xdfe\n".as_slice(), TETRAHEDRON.as_bytes()].concat();
        let mesh = read_mesh("a.obj", &in_memory(vec![("a.obj", latin)])).expect("Latin-1");
        assert_eq!(corners_of(&mesh[0].mesh), plain);
    }

    #[test]
    fn what_cannot_be_read_is_refused_with_its_line() {
        let cases = [
            ("a.obj", "v 0,5 0 0\n", "line 1: \"0,5\" has a decimal comma"),
            ("a.obj", "v 1 0\n", "line 1: \"v 1 0\" is not the place of a corner"),
            ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "line 4: the face names corner 9, but the file has 3"),
            ("a.obj", "v 0 0 0\nf 1 x 1\n", "line 2: \"x\" is no corner of a face"),
            ("a.obj", "v 0 0 0\nv 1 0 0\n", "the file has 2 corners and no face"),
            ("a.obj", "v 0 0 0\ncstype bspline\nsurf 0 1 0 1 1\n", "line 3: \"surf 0 1 0 1 1\" is a curved surface"),
            (
                "a.stl",
                "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0,5\n",
                "line 4: \"0,5\" has a decimal comma",
            ),
            ("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n", "line 4: the corner has fewer"),
            (
                "a.stl",
                "solid a\nfacet\nouter loop\nvertex 0 0 0\nendloop\nendfacet\n",
                "line 6: the facet that ends here",
            ),
            ("a.stl", "solid a\nfacet\nouter loop\nvertex 0 0 0\n", "the file is cut short"),
            ("a.stl", "solid a\nfacet\nloops\n", "line 3: \"loops\" is no line of a text STL"),
            ("a.stl", "version https://git-lfs.github.com/spec/v1\noid sha256:1\n", "git lfs pull"),
            ("a.obj", "<!DOCTYPE html>\n<html>", "web page"),
        ];
        for (name, text, said) in cases {
            let error = read_text(name, text).expect_err(text);
            assert!(error.contains(said), "{text}: {error}");
        }
    }

    #[test]
    fn text_stl_is_read_in_any_spelling() {
        let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
        let plain = corners_of(&read_text("a.stl", &format!("solid a\n{facet}endsolid a\n")).expect("plain"));
        let usual = format!("solid a\n{facet}endsolid a\n");
        let others = [
            usual.to_uppercase(),
            format!("\u{feff}{usual}"),
            usual.replace('\n', "\r"),
            usual.replace('\n', "\r\n"),
            usual.replace("endsolid", "end solid").replace("endloop", "end loop").replace("endfacet", "end facet"),
            usual.replace("normal 0 0 1", "normal nan nan -1.#IND"),
            format!("# made by hand\n{usual}"),
            format!("; from a scanner\n{usual}"),
            format!("solid a\n{facet}"),
        ];
        for text in others {
            let mesh = read_text("a.stl", &text).unwrap_or_else(|error| panic!("{error}: {text}"));
            assert_eq!(corners_of(&mesh), plain, "{text}");
        }
    }

    #[test]
    fn a_binary_stl_may_say_solid_and_end_in_a_remark_but_not_lie_about_its_count() {
        let of = |announced: u32, facets: usize, rest: &[u8]| {
            let mut bytes = b"solid by some exporter".to_vec();
            bytes.resize(80, b' ');
            bytes.extend(announced.to_le_bytes());
            // Normals that are no numbers.
            let facet: Vec<u8> = [f32::NAN; 3]
                .iter()
                .chain(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0])
                .flat_map(|x| x.to_le_bytes())
                .chain([0; 2])
                .collect();
            (0..facets).for_each(|_| bytes.extend(&facet));
            bytes.extend(rest);
            read_mesh("a.stl", &in_memory(vec![("a.stl", bytes)]))
                .map(|parts| parts[0].mesh.triangles.len())
                .map_err(|e| e.to_string())
        };
        assert_eq!((of(3, 3, b""), of(3, 3, b"remark.")), (Ok(3), Ok(3)));
        assert!(
            of(4, 3, b"")
                .is_err_and(|text| text.contains("announces 4 triangles but ends after 234 bytes, which hold 3"))
        );
        for announced in [0, 2] {
            assert!(of(announced, 3, b"").is_err_and(|text| text.contains("but 3 follow")));
        }
    }

    #[test]
    fn concave_polygons_are_triangulated_as_they_lie() {
        // A U in the plane z = 0, walked to the left, whose slot a fan would close.
        let u = [[0., 0.], [3., 0.], [3., 3.], [2., 3.], [2., 1.], [1., 1.], [1., 3.], [0., 3.]];
        for start in 0..8 {
            let polygon: Vec<u32> = (0..8).map(|k| (k + start) % 8).collect();
            let points: Vec<DVec3> = u.iter().map(|[x, y]| DVec3::new(*x, *y, 0.5)).collect();
            let mut triangles = Vec::new();
            triangulated(&points, &polygon, &mut triangles);
            assert_eq!(triangles.len(), 6);
            let areas = triangles.iter().map(|t| {
                let [a, b, c] = t.map(|k| points[k as usize]);
                0.5 * (b - a).cross(c - a).z
            });
            let areas: Vec<f64> = areas.collect();
            // The area is that of the U, and no triangle is turned over.
            assert!(
                (areas.iter().sum::<f64>() - 7.0).abs() < 1e-12 && areas.iter().all(|area| *area > 0.0),
                "{areas:?}"
            );
        }
    }

    #[test]
    fn other_formats_are_refused_by_name() {
        let result = read_mesh("robot.dae", &in_memory(vec![]));
        let text = result.err().map(|e| e.to_string()).unwrap_or_default();
        assert!(text.contains(".dae") && text.contains(".obj"), "{text}");
    }
}
