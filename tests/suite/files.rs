//! Objects and scenes from elsewhere. Sound ones of every kind are grasped; malformed ones of every kind are refused or
//! mended with a warning, and never bring the program down or make it hang.

mod foreign;
mod malformed;

/// A mesh as OBJ text.
fn obj_text(mesh: &palpate_geometry::TriMesh) -> String {
    let points = mesh.points.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z));
    let faces = mesh.triangles.iter().map(|t| t.map(|i| i + 1)).map(|[a, b, c]| format!("f {a} {b} {c}\n"));
    points.chain(faces).collect()
}
