//! Checking a mesh before physics trusts it, and mending what can be mended safely.
//!
//! Mended, with a note: corners that coincide, corners on an edge of a neighbour (T-junctions), triangles that repeat or
//! have two equal corners, winding that is mixed or inside out, small holes. Refused, with a reason: nothing to hold,
//! numbers that are not finite, no volume, holes too wide to guess, surfaces with no consistent inside.
//!
//! A mesh leaves here *balanced*: every edge is walked as often one way as the other, so that the winding number
//! is defined everywhere (Jacobson et al. 2013), which is what the distance bake relies on for its sign.

use super::TriMesh;
use glam::DVec3;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::{BTreeMap, BTreeSet};

/// Reason why a mesh is no solid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    #[error("the mesh is empty: it has no triangles with area")]
    Empty,
    #[error("corner {index} of the mesh is not a finite number")]
    NotFinite {
        /// Index of the corner.
        index: usize,
    },
    #[error("triangle {index} of the mesh refers to a corner that does not exist")]
    BadIndex {
        /// Index of the triangle.
        index: usize,
    },
    #[error("the mesh is flat: it encloses no volume (a sheet cannot be grasped; give it thickness)")]
    NoVolume,
    #[error(
        "the mesh is open: {holes} hole(s), the widest {widest_mm:.1} mm across, which is too wide to close safely; \
         close it in a modelling tool, or set object.collision = \"hull\""
    )]
    Open {
        /// Number of holes that remain.
        holes: usize,
        /// Width of the widest (mm).
        widest_mm: f64,
    },
    #[error(
        "three faces or more meet at {edges} edge(s) of the mesh: a wall inside the solid, or a fin on it; delete that in a \
         modelling tool, or set object.collision = \"hull\""
    )]
    InnerWall {
        /// Number of such edges.
        edges: usize,
    },
    #[error(
        "the mesh has no consistent inside (one-sided or tangled surface); repair it in a modelling tool, \
         or set object.collision = \"hull\""
    )]
    NotOrientable,
}

/// A mesh that physics can trust, and what had to be done to it.
#[derive(Clone, Debug)]
pub struct Repaired {
    /// The mended mesh.
    pub mesh: TriMesh,
    /// Corners that were joined, which every STL needs.
    pub joined: usize,
    /// Connected pieces of the surface.
    pub pieces: usize,
    /// One sentence for each other kind of repair; empty when the mesh was sound.
    pub notes: Vec<String>,
}

/// Corners closer than this share of the diagonal are one corner. Files in single precision repeat a corner to
/// about 1e-7 of their size; larger values begin to fuse the two sides of a 0.1 mm card in a 10 m scene.
const WELD: f64 = 2e-6;
/// Side of the cells in which corners are looked up, in welding tolerances: small, so that few corners share one.
const WELD_CELL: f64 = 4.0;

/// A hole is filled when it is narrower than this share of the diagonal: a missing facet or cap, not a missing side.
const SMALL_HOLE: f64 = 0.2;

/// Volume, as a share of the cube over the diagonal, below which a mesh counts as flat. A needle of 0.5 x 60 mm
/// has 5e-5, a 0.1 mm card of 85 x 54 mm has 5e-4.
const FLAT: f64 = 1e-7;

/// Checks and repairs a mesh. The module page lists repairs and refusals.
pub fn repair(mesh: &TriMesh) -> Result<Repaired, MeshError> {
    check_numbers(mesh)?;
    let diagonal = mesh.bounds().size().length();
    if mesh.triangles.is_empty() || diagonal <= 0.0 {
        return Err(MeshError::Empty);
    }
    let before = mesh.points.len();
    let attempt = |tolerance: f64| {
        let welded = weld(mesh, diagonal * tolerance);
        let joined = before - welded.points.len();
        // Two triangles back to back are a wall between two solids, which goes, or a face that is seen from both sides.
        closed(welded.clone(), diagonal, Sides::Cancel)
            .or_else(|fault| closed(welded.clone(), diagonal, Sides::Collapse).map_err(|_again| fault))
            .or_else(|fault| {
                let (split, edges) = split_at_corners(welded, diagonal * tolerance);
                let mut repaired = closed(split, diagonal, Sides::Cancel).map_err(|_again| fault)?;
                repaired.notes.push(format!("{edges} edge(s) were split at corners of their neighbours"));
                Ok(repaired)
            })
            .map(|repaired| Repaired { joined, ..repaired })
    };
    // Corners that were rounded are further apart; only a mesh that is open otherwise may need them joined.
    attempt(WELD).or_else(|fault| attempt(WIDE_WELD).map_err(|_again| fault))
}

/// Distance of corners that are joined where the mesh is open otherwise, in sizes of the mesh.
const WIDE_WELD: f64 = 2e-4;

/// What is done with two triangles back to back.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Sides {
    /// Both go.
    Cancel,
    /// One stays.
    Collapse,
}

/// Makes a welded mesh closed and outward.
fn closed(mut mesh: TriMesh, diagonal: f64, sides: Sides) -> Result<Repaired, MeshError> {
    let mut notes = Vec::new();
    drop_degenerate(&mut mesh, sides, &mut notes);
    if mesh.triangles.is_empty() {
        return Err(MeshError::Empty);
    }
    // No hull closes a sheet.
    if is_sheet(&mesh, diagonal) {
        return Err(MeshError::NoVolume);
    }
    let pieces = orient(&mut mesh, &mut notes)?;
    fill_holes(&mut mesh, diagonal * SMALL_HOLE, &mut notes)?;
    if mesh.signed_volume() < FLAT * diagonal.powi(3) {
        return Err(MeshError::NoVolume);
    }
    Ok(Repaired { mesh, joined: 0, pieces, notes })
}

fn check_numbers(mesh: &TriMesh) -> Result<(), MeshError> {
    if let Some(index) = mesh.points.iter().position(|p| !p.is_finite()) {
        return Err(MeshError::NotFinite { index });
    }
    let count = mesh.points.len() as u32;
    match mesh.triangles.iter().position(|t| t.iter().any(|i| *i >= count)) {
        Some(index) => Err(MeshError::BadIndex { index }),
        None => Ok(()),
    }
}

/// Gives corners that coincide one index.
fn weld(mesh: &TriMesh, tolerance: f64) -> TriMesh {
    let mut welded = TriMesh::default();
    let mut cells: FxHashMap<[i64; 3], Vec<u32>> = FxHashMap::default();
    let new_index: Vec<u32> = mesh
        .points
        .iter()
        .map(|p| {
            let known = cells_near(*p, tolerance)
                .filter_map(|cell| cells.get(&cell))
                .flatten()
                .find(|k| p.distance(welded.points[**k as usize]) <= tolerance);
            if let Some(known) = known {
                return *known;
            }
            let new = welded.points.len() as u32;
            welded.points.push(*p);
            cells.entry((*p / (WELD_CELL * tolerance)).to_array().map(|x| x.floor() as i64)).or_default().push(new);
            new
        })
        .collect();
    welded.triangles = mesh.triangles.iter().map(|t| t.map(|i| new_index[i as usize])).collect();
    welded
}

/// The cell of a point, and those whose border it is so near that a coinciding corner may lie beyond it.
fn cells_near(p: DVec3, tolerance: f64) -> impl Iterator<Item = [i64; 3]> {
    let u = (p / (WELD_CELL * tolerance)).to_array();
    let reach = 1.0 / WELD_CELL;
    let [xs, ys, zs] = u.map(|x| (x - reach).floor() as i64..=(x + reach).floor() as i64);
    xs.flat_map(move |x| {
        let zs = zs.clone();
        ys.clone().flat_map(move |y| zs.clone().map(move |z| [x, y, z]))
    })
}

/// Removes triangles with two equal corners, repeats, and those that lie back to back with another.
fn drop_degenerate(mesh: &mut TriMesh, sides: Sides, notes: &mut Vec<String>) {
    let before = mesh.triangles.len();
    mesh.triangles.retain(has_three_corners);
    // Per set of corners: how often it is wound one way and how often the other.
    let mut windings: FxHashMap<[u32; 3], i32> = FxHashMap::default();
    for t in &mesh.triangles {
        let (key, turn) = canonical(*t);
        *windings.entry(key).or_insert(0) += turn;
    }
    let mut kept: FxHashMap<[u32; 3], ()> = FxHashMap::default();
    mesh.triangles.retain(|t| {
        let (key, turn) = canonical(*t);
        let net = windings[&key];
        // A repeat keeps one of its copies.
        let stays = if net == 0 { sides == Sides::Collapse } else { net.signum() == turn };
        stays && kept.insert(key, ()).is_none()
    });
    let dropped = before - mesh.triangles.len();
    if dropped > 0 {
        notes.push(format!("{dropped} degenerate or repeated triangles were dropped"));
    }
}

/// Most pairs of a loose edge and a corner that are compared.
const MOST_PAIRS: usize = 20_000_000;
/// Most edges that are split, for each corner.
const MOST_SPLITS: usize = 3;

/// True for a triangle with three different corners.
fn has_three_corners(t: &[u32; 3]) -> bool {
    t[0] != t[1] && t[1] != t[2] && t[2] != t[0]
}

/// Splits triangles where the edge of one goes past corners of others, which modelling tools leave (T-junctions); returns how
/// often. Each corner splits the edges of few neighbours, else it is no such mesh.
fn split_at_corners(mut mesh: TriMesh, tolerance: f64) -> (TriMesh, usize) {
    mesh.triangles.retain(has_three_corners);
    let edges = edges_of(&mesh.triangles);
    let mut loose: FxHashSet<[u32; 2]> =
        edges.chunk_by(same_corners).filter(|sides| sides.len() == 1).map(|sides| sides[0].0).collect();
    let corners: BTreeSet<u32> = loose.iter().flatten().copied().collect();
    if loose.len() * corners.len() > MOST_PAIRS {
        return (mesh, 0);
    }
    let (before, most) = (mesh.triangles.len(), MOST_SPLITS * corners.len());
    let between = |points: &[DVec3], [a, b]: [u32; 2]| {
        let [from, to] = [a, b].map(|i| points[i as usize]);
        let (along, length) = ((to - from).normalize_or_zero(), from.distance(to));
        let is_inside = |corner: &u32| {
            let offset = points[*corner as usize] - from;
            let s = offset.dot(along);
            s > tolerance && s < length - tolerance && (offset - s * along).length() <= tolerance
        };
        corners.iter().copied().find(is_inside)
    };
    let mut index = 0;
    while let Some(&t) = mesh.triangles.get(index).filter(|_| mesh.triangles.len() - before <= most) {
        let split = [t, [t[1], t[2], t[0]], [t[2], t[0], t[1]]].into_iter().find_map(|[a, b, c]| {
            let corner = loose.contains(&[a.min(b), a.max(b)]).then(|| between(&mesh.points, [a, b]))??;
            (corner != c).then_some(([a, b, c], corner))
        });
        let Some(([a, b, c], corner)) = split else {
            index += 1;
            continue;
        };
        mesh.triangles[index] = [a, corner, c];
        mesh.triangles.push([corner, b, c]);
        loose.extend([a, b].map(|end| [end.min(corner), end.max(corner)]));
    }
    let splits = mesh.triangles.len() - before;
    (mesh, splits)
}

/// The corners in rising order, and whether the triangle walks them in that order (+1) or against it (-1).
fn canonical(t: [u32; 3]) -> ([u32; 3], i32) {
    let mut key = t;
    key.sort_unstable();
    let start = (0..3).find(|i| t[*i] == key[0]).unwrap_or(0);
    let turn = if t[(start + 1) % 3] == key[1] { 1 } else { -1 };
    (key, turn)
}

/// An edge of a triangle: its corners, the smaller first, the triangle, and whether that walks it upwards.
type Edge = ([u32; 2], usize, bool);

/// Edges of all triangles, those with the same corners side by side.
fn edges_of(triangles: &[[u32; 3]]) -> Vec<Edge> {
    let of = |(index, t): (usize, &[u32; 3])| {
        let ways = [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
        ways.map(|[a, b]| ([a.min(b), a.max(b)], index, a < b))
    };
    let mut edges: Vec<Edge> = triangles.iter().enumerate().flat_map(of).collect();
    edges.sort_unstable();
    edges
}

/// True for two edges with the same corners.
fn same_corners(a: &Edge, b: &Edge) -> bool {
    a.0 == b.0
}

/// Makes neighbours agree on their winding, piece by piece, and turns each piece to face outward; returns the number of pieces.
fn orient(mesh: &mut TriMesh, notes: &mut Vec<String>) -> Result<usize, MeshError> {
    let edges = edges_of(&mesh.triangles);
    let count = mesh.triangles.len();
    let mut neighbours: Vec<Vec<(usize, bool)>> = vec![Vec::new(); count];
    for sides in edges.chunk_by(same_corners) {
        if let [(_, a, a_up), (_, b, b_up)] = *sides {
            let agree = a_up != b_up;
            neighbours[a].push((b, agree));
            neighbours[b].push((a, agree));
        }
    }
    let mut flip: Vec<Option<bool>> = vec![None; count];
    let mut pieces = Vec::new();
    for seed in 0..count {
        if flip[seed].is_none() {
            let places = spread_orientation(seed, &neighbours, &mut flip)?;
            let triangles: Vec<[u32; 3]> =
                places.iter().map(|i| oriented_triangle(mesh.triangles[*i], flip[*i] == Some(true))).collect();
            let volume = mesh.signed_volume_of(&triangles);
            pieces.push(Piece { places, triangles, volume });
        }
    }
    let mut turned = 0;
    for k in 0..pieces.len() {
        // A piece faces outward, or, as the wall of a cavity, into the cavity.
        let inside_out = (pieces[k].volume < 0.0) != is_cavity(mesh, &pieces, k);
        for (i, t) in pieces[k].places.iter().zip(&pieces[k].triangles) {
            let t = oriented_triangle(*t, inside_out);
            turned += usize::from(t != mesh.triangles[*i]);
            mesh.triangles[*i] = t;
        }
    }
    if turned > 0 {
        notes.push(format!("the winding of {turned} triangles was turned to face outward"));
    }
    Ok(pieces.len())
}

/// A connected piece of a mesh.
struct Piece {
    /// Indices of its triangles in the mesh.
    places: Vec<usize>,
    /// The same, with one winding.
    triangles: Vec<[u32; 3]>,
    /// Volume with that winding (m³).
    volume: f64,
}

/// Corners of a piece that have to lie inside another, spread over it.
const CORNERS_TRIED: usize = 64;

/// With more pieces than this, cavities are not looked for: it is a heap of loose triangles.
const MOST_PIECES: usize = 64;

/// True for a piece that lies inside another and was wound the other way: files mean a hollow by that. A piece inside
/// another that is wound alike is a solid within a solid.
fn is_cavity(mesh: &TriMesh, pieces: &[Piece], k: usize) -> bool {
    if pieces.len() > MOST_PIECES {
        return false;
    }
    // Pieces that only overlap are solids of a union, whichever way they are wound.
    let triangles = &pieces[k].triangles;
    let tried = triangles.iter().step_by(triangles.len().div_ceil(CORNERS_TRIED));
    let corners: Vec<DVec3> = tried.map(|t| mesh.points[t[0] as usize]).collect();
    let surrounds = |outer: &&Piece| {
        outer.volume.abs() > pieces[k].volume.abs()
            && corners.iter().all(|corner| crossings(mesh, &outer.triangles, *corner) % 2 == 1)
    };
    let around: Vec<&Piece> = pieces.iter().filter(surrounds).collect();
    around.len() % 2 == 1 && around.iter().any(|outer| (outer.volume < 0.0) != (pieces[k].volume < 0.0))
}

/// Number of crossings of a ray from a point with some triangles. Its direction is oblique to usual edges.
fn crossings(mesh: &TriMesh, triangles: &[[u32; 3]], from: DVec3) -> usize {
    let direction = DVec3::new(0.816_18, 0.463_07, 0.345_51);
    let crosses = |t: &&[u32; 3]| {
        let [a, b, c] = mesh.corners(**t);
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(ac);
        let determinant = ab.dot(p);
        let s = from - a;
        let (u, q) = (s.dot(p) / determinant, s.cross(ab));
        let v = direction.dot(q) / determinant;
        u >= 0.0 && v >= 0.0 && u + v <= 1.0 && ac.dot(q) / determinant > 0.0
    };
    triangles.iter().filter(crosses).count()
}

fn oriented_triangle([a, b, c]: [u32; 3], flip: bool) -> [u32; 3] {
    if flip { [a, c, b] } else { [a, b, c] }
}

/// Walks one connected piece from a seed; returns its triangles. Fails where two walks disagree.
fn spread_orientation(
    seed: usize,
    neighbours: &[Vec<(usize, bool)>],
    flip: &mut [Option<bool>],
) -> Result<Vec<usize>, MeshError> {
    flip[seed] = Some(false);
    let mut piece = vec![seed];
    let mut next = 0;
    while let Some(&current) = piece.get(next) {
        next += 1;
        let current_flip = flip[current] == Some(true);
        for &(other, agree) in &neighbours[current] {
            let wanted = current_flip == agree;
            match flip[other] {
                None => {
                    flip[other] = Some(wanted);
                    piece.push(other);
                }
                Some(found) if found != wanted => return Err(MeshError::NotOrientable),
                Some(_) => {}
            }
        }
    }
    Ok(piece)
}

/// True where all points lie in the plane of the largest triangle.
fn is_sheet(mesh: &TriMesh, diagonal: f64) -> bool {
    let corners = |triangle: &[u32; 3]| triangle.map(|i| mesh.points[i as usize]);
    let across = |[a, b, c]: [DVec3; 3]| (a, (b - a).cross(c - a));
    let planes = mesh.triangles.iter().map(|triangle| across(corners(triangle)));
    let Some((at, across)) = planes.max_by(|a, b| a.1.length().total_cmp(&b.1.length())) else { return true };
    let is_in = |point: DVec3| (point - at).dot(across.normalize_or_zero()).abs() <= FLAT * diagonal;
    mesh.triangles.iter().flat_map(corners).all(is_in)
}

/// Closes narrow holes with a fan about their middle; refuses wide ones.
fn fill_holes(mesh: &mut TriMesh, widest_allowed: f64, notes: &mut Vec<String>) -> Result<(), MeshError> {
    let loops = boundary_loops(&mesh.triangles)?;
    let width = |hole: &[u32]| super::Bounds::of(hole.iter().map(|i| mesh.points[*i as usize])).size().length();
    let widest = loops.iter().map(|hole| width(hole)).fold(0.0, f64::max);
    let wide = loops.iter().filter(|hole| width(hole) > widest_allowed).count();
    if wide > 0 {
        // No hull helps a sheet.
        let edges = edges_of(&mesh.triangles);
        let crowded = edges.chunk_by(same_corners).filter(|sides| sides.len() > 2).count();
        if crowded > 0 && edges.chunk_by(same_corners).all(|sides| sides.len() > 1) {
            return Err(MeshError::InnerWall { edges: crowded });
        }
        return Err(MeshError::Open { holes: wide, widest_mm: widest * 1e3 });
    }
    for hole in &loops {
        let middle = hole.iter().map(|i| mesh.points[*i as usize]).sum::<DVec3>() / hole.len() as f64;
        let hub = mesh.points.len() as u32;
        mesh.points.push(middle);
        for k in 0..hole.len() {
            mesh.triangles.push([hole[k], hole[(k + 1) % hole.len()], hub]);
        }
    }
    if !loops.is_empty() {
        notes.push(format!("{} small hole(s) were closed", loops.len()));
    }
    Ok(())
}

/// Loops of unbalanced edges, each walked in the direction that the missing triangles would have.
fn boundary_loops(triangles: &[[u32; 3]]) -> Result<Vec<Vec<u32>>, MeshError> {
    let mut leaving: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for sides in edges_of(triangles).chunk_by(same_corners) {
        let [a, b] = sides[0].0;
        let balance: i32 = sides.iter().map(|(.., up)| if *up { 1 } else { -1 }).sum();
        let (from, to) = if balance > 0 { (b, a) } else { (a, b) };
        for _ in 0..balance.abs() {
            leaving.entry(from).or_default().push(to);
        }
    }
    let mut loops = Vec::new();
    while let Some((&start, _)) = leaving.first_key_value() {
        let mut hole = vec![start];
        let mut at = start;
        loop {
            let next = leaving.get_mut(&at).and_then(Vec::pop);
            if leaving.get(&at).is_some_and(Vec::is_empty) {
                leaving.remove(&at);
            }
            match next {
                Some(next) if next == start => break,
                Some(next) => {
                    hole.push(next);
                    at = next;
                }
                None => return Err(MeshError::NotOrientable),
            }
        }
        loops.push(hole);
    }
    Ok(loops)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Primitive;

    fn cube() -> TriMesh {
        Primitive::Cuboid { half: DVec3::splat(0.5) }.tessellate()
    }

    #[test]
    fn a_sound_cube_is_left_alone() {
        let repaired = repair(&cube()).expect("sound");
        assert_eq!(repaired.mesh, cube());
        assert!(repaired.notes.is_empty());
    }

    #[test]
    fn corners_on_the_edge_of_a_neighbour_leave_no_gap() {
        // One side of a cube has two more corners on an edge that it shares.
        let mut mesh = cube();
        let place =
            mesh.triangles.iter().position(|t| t.iter().all(|i| mesh.points[*i as usize].x > 0.0)).expect("a side");
        let side = mesh.triangles.remove(place);
        let [a, b, c] = side;
        let (from, to) = (mesh.points[a as usize], mesh.points[b as usize]);
        let first = mesh.points.len() as u32;
        mesh.points.extend([from.lerp(to, 0.3), from.lerp(to, 0.7)]);
        mesh.triangles.extend([[a, first, c], [first, first + 1, c], [first + 1, b, c]]);
        let repaired = repair(&mesh).expect("mendable");
        assert!((repaired.mesh.signed_volume() - 1.0).abs() < 1e-12);
        assert!(edges_of(&repaired.mesh.triangles).chunk_by(same_corners).all(|sides| sides.len() == 2));
        assert_eq!(repaired.notes, ["2 edge(s) were split at corners of their neighbours"]);
    }

    #[test]
    fn a_heap_of_triangles_on_one_line_is_given_up_soon() {
        // Every edge passes the corners of all triangles within it.
        let count = 1000;
        let along = (0..2 * count).map(|k| DVec3::new(f64::from(k), 0.0, 0.0));
        let mut mesh = TriMesh { points: along.collect(), ..TriMesh::default() };
        mesh.points.push(DVec3::new(0.0, 900.0, 0.0));
        let apex = 2 * count as u32;
        mesh.triangles = (0..count as u32).map(|k| [k, apex - 1 - k, apex]).collect();
        let (split, times) = split_at_corners(mesh, 1e-6);
        assert!(times <= MOST_SPLITS * (apex as usize + 1) + 1 && split.triangles.len() == times + count as usize);
    }

    #[test]
    fn a_wall_inside_a_solid_is_no_hole() {
        let mut mesh = cube();
        let corner = |x: f64, y: f64, z: f64| {
            mesh.points.iter().position(|p| *p == 0.5 * DVec3::new(x, y, z)).expect("a corner") as u32
        };
        let wall = [corner(-1.0, -1.0, -1.0), corner(1.0, 1.0, -1.0), corner(1.0, 1.0, 1.0), corner(-1.0, -1.0, 1.0)];
        mesh.triangles.extend([[wall[0], wall[1], wall[2]], [wall[0], wall[2], wall[3]]]);
        assert!(
            matches!(repair(&mesh), Err(MeshError::InnerWall { .. } | MeshError::NotOrientable)),
            "{:?}",
            repair(&mesh)
        );
    }

    #[test]
    fn an_inverted_cube_is_turned() {
        let mut mesh = cube();
        for t in &mut mesh.triangles {
            t.swap(1, 2);
        }
        let repaired = repair(&mesh).expect("mendable");
        assert!((repaired.mesh.signed_volume() - 1.0).abs() < 1e-12);
        assert_eq!(repaired.notes.len(), 1);
    }

    #[test]
    fn mixed_winding_is_made_consistent() {
        let mut mesh = cube();
        for t in mesh.triangles.iter_mut().step_by(3) {
            t.swap(0, 1);
        }
        assert!((repair(&mesh).expect("mendable").mesh.signed_volume() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_hollow_stays_hollow_and_a_solid_within_a_solid_stays_solid() {
        let inner = |turned: bool| {
            let mut mesh = cube();
            mesh.scale(DVec3::splat(0.5));
            for t in &mut mesh.triangles {
                *t = oriented_triangle(*t, turned);
            }
            mesh
        };
        let with = |inner: &TriMesh, all_turned: bool| {
            let mut mesh = cube();
            mesh.append(inner);
            for t in &mut mesh.triangles {
                *t = oriented_triangle(*t, all_turned);
            }
            repair(&mesh).expect("a solid").mesh.signed_volume()
        };
        for all_turned in [false, true] {
            assert!((with(&inner(true), all_turned) - 0.875).abs() < 1e-12, "hollow");
            assert!((with(&inner(false), all_turned) - 1.125).abs() < 1e-12, "overlapping solids count twice");
        }
    }

    #[test]
    fn corners_on_both_sides_of_a_cell_s_border_are_joined() {
        let mut mesh = cube();
        let shared: Vec<[DVec3; 3]> = mesh.triangles.iter().map(|t| mesh.corners(*t)).collect();
        mesh.points = shared.iter().flatten().copied().collect();
        mesh.triangles = (0..shared.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        // Noise as large as single precision leaves it, at 300 places against the cells.
        for shift in 0..300 {
            let mut noisy = mesh.clone();
            for (k, p) in noisy.points.iter_mut().enumerate() {
                let noise = (k * 7 % 5) as f64 * 5e-8;
                *p += DVec3::splat(f64::from(shift) * 1.7e-7 + noise);
            }
            assert_eq!(repair(&noisy).expect("a cube").mesh.points.len(), 8, "shift {shift}");
        }
    }

    #[test]
    fn unshared_corners_are_joined() {
        let cube = cube();
        let mut soup = TriMesh::default();
        for t in &cube.triangles {
            let at = soup.points.len() as u32;
            soup.points.extend(cube.corners(*t));
            soup.triangles.push([at, at + 1, at + 2]);
        }
        let repaired = repair(&soup).expect("mendable");
        assert_eq!(repaired.mesh.points.len(), 8);
        assert!((repaired.mesh.signed_volume() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_small_hole_is_closed_and_a_wide_one_refused() {
        let mut ball = Primitive::Sphere { radius: 0.5 }.tessellate();
        let whole = ball.signed_volume();
        ball.triangles.drain(1000..1002);
        let repaired = repair(&ball).expect("a missing facet can be closed");
        assert!((repaired.mesh.signed_volume() / whole - 1.0).abs() < 1e-3);

        let mut open_box = cube();
        open_box.triangles.truncate(10);
        assert!(matches!(repair(&open_box), Err(MeshError::Open { holes: 1, .. })));
        // Two triangles of it are a sheet, which no hull helps.
        open_box.triangles.truncate(2);
        assert!(matches!(repair(&open_box), Err(MeshError::NoVolume)));
    }

    #[test]
    fn meshes_that_are_no_solid_are_refused() {
        assert_eq!(repair(&TriMesh::default()).err(), Some(MeshError::Empty));
        let mut broken = cube();
        broken.points[3].y = f64::NAN;
        assert_eq!(repair(&broken).err(), Some(MeshError::NotFinite { index: 3 }));
        let mut dangling = cube();
        dangling.triangles[2][1] = 99;
        assert_eq!(repair(&dangling).err(), Some(MeshError::BadIndex { index: 2 }));
        // A sheet seen from both sides cancels itself.
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        let sheet = TriMesh { points, triangles: vec![[0, 1, 2], [0, 2, 1]] };
        assert_eq!(repair(&sheet).err(), Some(MeshError::Empty));
        let mut flat = cube();
        flat.scale(DVec3::new(1.0, 1.0, 0.0));
        assert!(repair(&flat).is_err());
    }

    #[test]
    fn a_one_sided_surface_is_refused() {
        // A Möbius strip of five quads.
        let mut points = Vec::new();
        for k in 0..5 {
            let around = f64::from(k) * std::f64::consts::TAU / 5.0;
            let (sin, cos) = around.sin_cos();
            let half = DVec3::new(cos * (0.5 * around).cos(), sin * (0.5 * around).cos(), (0.5 * around).sin()) * 0.2;
            let middle = DVec3::new(cos, sin, 0.0);
            points.extend([middle - half, middle + half]);
        }
        let mut triangles = Vec::new();
        for k in 0..5u32 {
            let (a, b) = (2 * k, 2 * k + 1);
            let (c, d) = if k == 4 { (1, 0) } else { (2 * k + 2, 2 * k + 3) };
            triangles.extend([[a, c, d], [a, d, b]]);
        }
        assert_eq!(repair(&TriMesh { points, triangles }).err(), Some(MeshError::NotOrientable));
    }
}
