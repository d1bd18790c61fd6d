//! From the shapes and masses that a file declares to an object ready for simulation and drawing.

use super::{CollisionShape, LoadOptions, ObjectError, ObjectModel, Resting};
use palpate_geometry::palette::Rgb;
use palpate_geometry::units::three_digits;
use palpate_geometry::{
    BakeError, Bounds, ColouredPart, DistanceField, DistanceGrid, Finish, MassProperties, Pose, Primitive, SolidPart,
    SurfaceMesh, TriMesh, bake, bake_once, choose_cell, mass_properties, repair, support_points, union_mass,
};
use std::collections::BTreeSet;
use std::sync::Arc;

/// A shape as a file declares it, in its own frame.
pub(super) enum ShapeSource {
    /// A primitive solid.
    Primitive(Primitive),
    /// A mesh file's parts, scaled.
    Mesh(Vec<ColouredPart>),
}

/// Mass of one link as the file declares it.
pub(super) struct Inertial {
    pub(super) link: String,
    /// In the object's frame; absent where the file has no usable value.
    pub(super) declared: Option<MassProperties>,
}

/// Everything gathered from a file, in its own units and in the frame of its root.
pub(super) struct Blueprint {
    /// What messages call it: the name of its file, or of a built-in object.
    pub(super) name: String,
    /// Name of the robot in a URDF.
    pub(super) robot: Option<String>,
    pub(super) visual: Vec<ColouredPart>,
    pub(super) visual_solids: Vec<SolidPart>,
    pub(super) collision: Vec<SolidPart>,
    pub(super) inertials: Vec<Inertial>,
    /// Triangles of all meshes, seen and touched.
    triangles: usize,
    /// Young's modulus of the surface (Pa), where the file gives one.
    pub(super) modulus: Option<f64>,
    /// Coefficient of friction, where the file gives one.
    pub(super) friction: Option<f64>,
    /// True where what parts share is as heavy as each of them.
    pub(super) overlap_is_denser: bool,
    pub(super) warnings: Vec<String>,
    /// The link whose shapes are added, and those of the solids that are seen and touched.
    pub(super) link: String,
    visual_links: Vec<String>,
    collision_links: Vec<String>,
}

/// An object larger than this is taken to be in millimetres when that makes sense of it (m).
const LARGEST_PLAUSIBLE: f64 = 3.0;
/// An object smaller than this if in millimetres is taken to be in centimetres (m): little that is grasped is as small.
const SMALL: f64 = 0.012;
/// An object smaller than this is taken to be given in units of a thousand metres (m).
const SMALLEST_PLAUSIBLE: f64 = 5e-4;
/// What is larger than this (m) does not fit between the fingers, and smaller than this, between two taxels.
const GRASPABLE: std::ops::RangeInclusive<f64> = 2e-3..=0.5;
/// Thinner things are mistakes (m).
const THINNEST: f64 = 1e-5;
/// Nothing that is grasped weighs less (kg).
const LIGHTEST: f64 = 1e-6;
/// Densities that solids have, from foams to metals (kg/m³).
const DENSITIES: std::ops::RangeInclusive<f64> = 1.0..=25_000.0;
/// Units that files are written in, and their size (m).
const LENGTHS: [(&str, f64); 4] =
    [("millimetres", 1e-3), ("centimetres", 1e-2), ("inches", 0.0254), ("metres, scaled to millimetres twice", 1e3)];
/// Solids of one object beyond this are refused.
const MOST_SOLIDS: usize = 1000;
/// Triangles of one object beyond this are refused, however many meshes they come in.
const MOST_TRIANGLES: usize = 4_000_000;
/// Friction coefficient where nothing is known of the surface: plastic and varnished wood.
const DEFAULT_FRICTION: f64 = 0.6;
/// Colour where the file gives none.
const DEFAULT_COLOUR: Rgb = Rgb(196, 190, 180);

impl Blueprint {
    pub(super) fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            robot: None,
            visual: Vec::new(),
            visual_solids: Vec::new(),
            collision: Vec::new(),
            inertials: Vec::new(),
            triangles: 0,
            modulus: None,
            friction: None,
            overlap_is_denser: false,
            warnings: Vec::new(),
            link: String::new(),
            visual_links: Vec::new(),
            collision_links: Vec::new(),
        }
    }

    /// Counts the triangles of a mesh; false when the object would have too many of them in all.
    fn makes_room_for(&mut self, shape: &ShapeSource) -> bool {
        if let ShapeSource::Mesh(parts) = shape {
            self.triangles += parts.iter().map(|part| part.mesh.triangles.len()).sum::<usize>();
        }
        self.triangles <= MOST_TRIANGLES
    }

    /// Adds a visual shape. A colour given here overrides those of the mesh file, as in every URDF viewer.
    pub(super) fn add_visual(&mut self, shape: &ShapeSource, place: &Pose, colour: Option<Rgb>) {
        if !self.makes_room_for(shape) {
            return;
        }
        self.visual_links.push(self.link.clone());
        match shape {
            ShapeSource::Primitive(primitive) => {
                let mut mesh = primitive.tessellate();
                mesh.transform(place);
                self.visual.push(ColouredPart { mesh, colour, finish: Finish::default() });
                self.visual_solids.push(SolidPart::Primitive(*primitive, *place));
            }
            ShapeSource::Mesh(parts) => {
                for part in parts {
                    let mut mesh = part.mesh.clone();
                    mesh.transform(place);
                    self.visual.push(ColouredPart { mesh, colour: colour.or(part.colour), finish: part.finish });
                }
                self.visual_solids.push(SolidPart::Mesh(joined(parts, place)));
            }
        }
    }

    /// Adds a collision shape.
    pub(super) fn add_collision(&mut self, shape: &ShapeSource, place: &Pose) {
        if !self.makes_room_for(shape) {
            return;
        }
        self.collision_links.push(self.link.clone());
        self.collision.push(match shape {
            ShapeSource::Primitive(primitive) => SolidPart::Primitive(*primitive, *place),
            ShapeSource::Mesh(parts) => SolidPart::Mesh(joined(parts, place)),
        });
    }

    /// Takes the visual shapes that were added last as collision shapes too.
    pub(super) fn touch_visual(&mut self, last: usize) {
        let from = self.visual_solids.len().saturating_sub(last);
        self.collision.extend_from_slice(&self.visual_solids[from..]);
        self.collision_links.extend_from_slice(&self.visual_links[from..]);
    }

    /// Builds the object with the options of a scene. The baked distances are kept in files of the folder for caches.
    pub(super) fn build(self, options: &LoadOptions) -> Result<ObjectModel, ObjectError> {
        let folders = directories::ProjectDirs::from("", "", "palpate");
        let Some(folders) = folders else { return self.build_with(options, bake) };
        self.build_with(options, |solids, cell| bake_once(solids, cell, &folders.cache_dir().join("grids")))
    }

    /// The same with another way to bake distances.
    pub(super) fn build_with(
        mut self,
        options: &LoadOptions,
        bake: impl FnOnce(&[SolidPart], f64) -> Result<DistanceGrid, BakeError>,
    ) -> Result<ObjectModel, ObjectError> {
        if self.triangles > MOST_TRIANGLES {
            let cause = format!("its meshes have more than {MOST_TRIANGLES} triangles in all");
            return Err(ObjectError::malformed(&self.name, &cause));
        }
        let (mut solids, mut links) = match options.collision {
            CollisionShape::File if !self.collision.is_empty() => {
                (std::mem::take(&mut self.collision), std::mem::take(&mut self.collision_links))
            }
            CollisionShape::File | CollisionShape::Visual => {
                (std::mem::take(&mut self.visual_solids), std::mem::take(&mut self.visual_links))
            }
            CollisionShape::Hull => {
                let all = if self.collision.is_empty() { &self.visual_solids } else { &self.collision };
                (vec![SolidPart::Mesh(hull_of(all, &self.name)?)], vec![String::new()])
            }
        };
        // Equal solids in one place are one.
        let mut seen = BTreeSet::new();
        let is_first = |solid: &SolidPart| matches!(solid, SolidPart::Mesh(_)) || seen.insert(format!("{solid:?}"));
        let is_first: Vec<bool> = solids.iter().map(is_first).collect();
        let [mut of_solid, mut of_link] = [is_first.iter(), is_first.iter()];
        solids.retain(|_| of_solid.next() == Some(&true));
        links.retain(|_| of_link.next() == Some(&true));
        if solids.len() > MOST_SOLIDS {
            let cause = format!("it has {} solids, more than {MOST_SOLIDS}; join them into a mesh", solids.len());
            return Err(ObjectError::malformed(&self.name, &cause));
        }
        // What a message is about: the whole object, or one of its links.
        let names: Vec<String> = match links.len() {
            1 => vec![self.name.clone()],
            _ => links.iter().map(|link| format!("{}, link {link}", self.name)).collect(),
        };
        if solids.is_empty() {
            let why = if self.warnings.is_empty() { String::new() } else { format!(" ({})", self.warnings.join("; ")) };
            return Err(ObjectError(format!(
                "\"{}\" has no shape: no link has a visual or collision that can be used{why}",
                self.name
            )));
        }
        self.check_numbers(&solids)?;
        let scale = self.scale(options, &solids, &names)?;
        scale_solids(&mut solids, scale);
        for part in &mut self.visual {
            part.mesh.scale(glam::DVec3::splat(scale));
        }
        let several = self.repair_meshes(&mut solids, &names)?;
        for (solid, name) in solids.iter().zip(&names) {
            let thickness = solid.bounds().size().min_element();
            if thickness < THINNEST {
                return Err(ObjectError(format!("\"{name}\" is {thickness:.1e} m thick; give it at least 0.01 mm")));
            }
        }
        let bounds = solids.iter().map(SolidPart::bounds).fold(Bounds::EMPTY, Bounds::union);
        self.check_size(&bounds, scale)?;
        let mass = self.mass(options, &solids, several, scale);
        let field = match solids.as_slice() {
            [SolidPart::Primitive(shape, place)] => DistanceField::primitive(*shape, place),
            _ => {
                let grid = bake(&solids, options.cell.unwrap_or_else(|| choose_cell(&bounds)));
                let grid = grid.map_err(|cause| ObjectError(format!("\"{}\": {cause}", self.name)))?;
                DistanceField::Grid(Arc::new(grid))
            }
        };
        Ok(ObjectModel {
            surface: Arc::new(self.surface_or(&solids)),
            name: self.name,
            class: None,
            field,
            resting: resting_of(&solids),
            parts: solids.into(),
            mass,
            friction: self.friction.unwrap_or(DEFAULT_FRICTION),
            modulus: self.modulus,
            bounds,
            warnings: self.warnings,
            content: 0,
        })
    }

    /// What is seen, as the file declares it: without a repair, a scale or a check.
    pub(super) fn surface(&self) -> SurfaceMesh {
        self.surface_or(&self.collision)
    }

    /// The visual shapes, or these solids where there are none.
    fn surface_or(&self, solids: &[SolidPart]) -> SurfaceMesh {
        if self.visual.is_empty() { surface_of(solids) } else { SurfaceMesh::from_parts(&self.visual, DEFAULT_COLOUR) }
    }

    fn check_numbers(&self, solids: &[SolidPart]) -> Result<(), ObjectError> {
        let finite = |mesh: &TriMesh| mesh.points.iter().all(|p| p.is_finite());
        let sound = solids.iter().all(|solid| match solid {
            SolidPart::Mesh(mesh) => finite(mesh),
            SolidPart::Primitive(..) => true,
        });
        if sound && self.visual.iter().all(|part| finite(&part.mesh)) {
            Ok(())
        } else {
            Err(ObjectError::malformed(&self.name, "a mesh holds numbers that are not finite"))
        }
    }

    /// Factor on lengths: that of the scene, or a guess with a warning.
    fn scale(&mut self, options: &LoadOptions, solids: &[SolidPart], names: &[String]) -> Result<f64, ObjectError> {
        if let Some(scale) = options.scale {
            return Ok(scale);
        }
        let size = solids.iter().map(SolidPart::bounds).fold(Bounds::EMPTY, Bounds::union).size().max_element();
        let (scale, guess) = if size > LARGEST_PLAUSIBLE && size * 1e-3 < SMALL {
            (1e-2, "centimetres taken for metres")
        } else if size > LARGEST_PLAUSIBLE {
            (1e-3, "millimetres taken for metres")
        } else if size > 0.0 && size < SMALLEST_PLAUSIBLE {
            (1e3, "metres scaled to millimetres twice")
        } else {
            return Ok(1.0);
        };
        let across = |solid: &SolidPart| solid.bounds().size().max_element();
        let [mut large, mut small] = [names.iter().zip(solids), names.iter().zip(solids)];
        if let Some((large, _)) = large.find(|(_, solid)| across(solid) > LARGEST_PLAUSIBLE)
            && let Some((small, other)) = small.find(|(_, solid)| GRASPABLE.contains(&across(solid)))
        {
            return Err(ObjectError(format!(
                "\"{large}\" is {} m across, but \"{small}\" {} mm: their units differ; write scale=\"0.001 0.001 0.001\" in \
                 the <mesh> that is in millimetres",
                three_digits(size),
                three_digits(across(other) * 1e3)
            )));
        }
        let after = size * scale * 1e3;
        self.warnings.push(format!(
            "as given, \"{}\" is {} m across: {guess}? It is used at {} mm; set object.scale to decide",
            self.name,
            three_digits(size),
            three_digits(after),
        ));
        Ok(scale)
    }

    fn check_size(&self, bounds: &Bounds, scale: f64) -> Result<(), ObjectError> {
        let largest = bounds.size().max_element();
        let name = &self.name;
        if !bounds.size().is_finite() || !GRASPABLE.contains(&largest) {
            let [least, most] = [GRASPABLE.start() * 1e3, GRASPABLE.end() * 1e3];
            // What the lengths would be in other units.
            let other = |(unit, size): &(&str, f64)| {
                let across = largest / scale * size;
                let fits = (10e-3..=300e-3).contains(&across) && *size != scale;
                fits.then(|| format!("in {unit} it would be {} mm (object.scale = {size})", three_digits(across * 1e3)))
            };
            let others: Vec<String> = LENGTHS.iter().filter_map(other).collect();
            let others = if others.is_empty() { "set object.scale".to_owned() } else { others.join(", ") };
            return Err(ObjectError(format!(
                "\"{name}\" is {} mm across; objects from {least} to {most} mm can be grasped. Are its lengths in another \
                 unit? {others}",
                three_digits(largest * 1e3)
            )));
        }
        Ok(())
    }

    /// Repairs all meshes; returns whether the object is made of several pieces, which may overlap.
    fn repair_meshes(&mut self, solids: &mut [SolidPart], names: &[String]) -> Result<bool, ObjectError> {
        let mut pieces = solids.iter().filter(|solid| matches!(solid, SolidPart::Primitive(..))).count();
        for (solid, name) in solids.iter_mut().zip(names) {
            if let SolidPart::Mesh(mesh) = solid {
                let repaired = repair(mesh).map_err(|cause| ObjectError::unsound(name, &cause))?;
                *mesh = repaired.mesh;
                pieces += repaired.pieces;
                self.warnings.extend(repaired.notes.into_iter().map(|note| format!("mesh of \"{name}\": {note}")));
            }
        }
        Ok(pieces > 1)
    }

    /// Mass from the scene, the file, or volume and density, in this order.
    fn mass(&mut self, options: &LoadOptions, solids: &[SolidPart], several: bool, scale: f64) -> MassProperties {
        let sum = solids
            .iter()
            .map(|solid| match solid {
                SolidPart::Primitive(shape, place) => {
                    let unit = shape.mass_properties();
                    unit.with_mass(unit.mass * options.density).seen_from(place)
                }
                SolidPart::Mesh(mesh) => mass_properties(mesh, options.density),
            })
            .fold(MassProperties::ZERO, |sum, part| sum.welded_to(&part));
        let overlap =
            (several && !self.overlap_is_denser).then(|| without_overlap(&sum, solids, options.density)).flatten();
        let from_shape = overlap.unwrap_or(sum);
        let from_shape = self.sound_or_boxed(from_shape, solids);
        let declared = self
            .inertials
            .iter()
            .filter_map(|inertial| inertial.declared)
            .map(|m| MassProperties { mass: m.mass, centre: m.centre * scale, inertia: m.inertia * (scale * scale) })
            .fold(MassProperties::ZERO, |sum, part| sum.welded_to(&part));
        let missing: Vec<&str> =
            self.inertials.iter().filter(|i| i.declared.is_none()).map(|i| i.link.as_str()).collect();
        let is_declared = declared.mass >= LIGHTEST;
        let mut chosen = if is_declared && !missing.is_empty() {
            let links = missing.join("\", \"");
            self.warnings.push(format!("link \"{links}\" has no usable mass; it is counted as weightless"));
            declared
        } else if is_declared {
            declared
        } else {
            if options.mass.is_none() {
                let (density, grams) = (options.density, three_digits(from_shape.mass * 1e3));
                let share = overlap.map(|union| 100.0 * (1.0 - union.mass / sum.mass));
                let shared = share.map_or_else(String::new, |share| {
                    format!(" (its parts overlap by {share:.0} % of theirs, which counts once)")
                });
                self.warnings.push(format!(
                    "\"{}\" gives no usable mass; {grams} g follow from its volume at {density} kg/m³{shared}",
                    self.name
                ));
            }
            from_shape
        };
        let reach = |m: &MassProperties| {
            let bounds = solids.iter().map(SolidPart::bounds).fold(Bounds::EMPTY, Bounds::union);
            bounds.grown(0.5 * bounds.size().max_element()).distance(m.centre) == 0.0
        };
        let density = chosen.mass / from_shape.mass * options.density;
        let odd_mass = options.mass.is_none() && is_declared && !DENSITIES.contains(&density);
        if odd_mass {
            let cm3 = from_shape.mass / options.density * 1e6;
            self.warnings.push(format!(
                "the mass that \"{}\" declares is doubtful: {} kg on {} cm³ is {density:.0} kg/m³; set object.mass (kg) to decide",
                self.name,
                three_digits(chosen.mass),
                three_digits(cm3)
            ));
        }
        let fits = inertia_fits(&chosen, &from_shape);
        if odd_mass && !fits {
            chosen = from_shape.with_mass(chosen.mass);
        } else if !chosen.is_physical() || !reach(&chosen) || !fits {
            let (what, fault) = match chosen.is_physical() && !reach(&chosen) {
                true => ("centre of mass", "lies far outside its shape; it and the inertia were"),
                false => ("inertia", "is impossible for its shape; it was"),
            };
            self.warnings.push(format!("the {what} that \"{}\" declares {fault} computed from the shape", self.name));
            chosen = from_shape.with_mass(chosen.mass);
        }
        match options.mass {
            Some(mass) => chosen.with_mass(mass),
            None => chosen,
        }
    }
}

/// Share of the volume by which solids have to overlap to be counted as one.
const OVERLAP: f64 = 2e-3;

impl Blueprint {
    /// Mass properties that a body can have: those computed, or where a tangled mesh gives impossible ones, those of a
    /// box around it.
    fn sound_or_boxed(&mut self, computed: MassProperties, solids: &[SolidPart]) -> MassProperties {
        if computed.is_physical() {
            return computed;
        }
        let bounds = solids.iter().map(SolidPart::bounds).fold(Bounds::EMPTY, Bounds::union);
        let half = (0.5 * bounds.size()).max(glam::DVec3::splat(1e-5));
        let cuboid = Primitive::Cuboid { half };
        self.warnings.push(format!("the mesh of \"{}\" is tangled: its inertia is that of a box around it", self.name));
        let mass = if computed.mass.is_finite() && computed.mass > 0.0 {
            computed.mass
        } else {
            cuboid.mass_properties().mass
        };
        cuboid.mass_properties().with_mass(mass).seen_from(&Pose::from_position(bounds.centre()))
    }
}

/// Mass properties of several pieces where what they share counts once; none where they share nothing, for which their plain sum
/// is exact.
fn without_overlap(sum: &MassProperties, solids: &[SolidPart], density: f64) -> Option<MassProperties> {
    let union = union_mass(solids, density);
    (union.mass > 0.0 && union.mass < (1.0 - OVERLAP) * sum.mass).then_some(union)
}

/// Declared inertias off by more than this factor per kilogram are unit errors or placeholders, not hollow bodies.
const INERTIA_SLACK: f64 = 30.0;

fn inertia_fits(declared: &MassProperties, from_shape: &MassProperties) -> bool {
    let per_mass = |m: &MassProperties| (m.inertia.x_axis.x + m.inertia.y_axis.y + m.inertia.z_axis.z) / m.mass;
    let ratio = per_mass(declared) / per_mass(from_shape);
    from_shape.mass <= 0.0 || (1.0 / INERTIA_SLACK..=INERTIA_SLACK).contains(&ratio)
}

fn joined(parts: &[ColouredPart], place: &Pose) -> TriMesh {
    let mut whole = TriMesh::default();
    for part in parts {
        whole.append(&part.mesh);
    }
    whole.transform(place);
    whole
}

fn scale_solids(solids: &mut [SolidPart], scale: f64) {
    for solid in solids {
        match solid {
            SolidPart::Mesh(mesh) => mesh.scale(glam::DVec3::splat(scale)),
            SolidPart::Primitive(shape, place) => {
                place.position *= scale;
                *shape = shape.scaled(scale);
            }
        }
    }
}

fn surface_of(solids: &[SolidPart]) -> SurfaceMesh {
    let mut surface = SurfaceMesh::default();
    for solid in solids {
        surface.add(&mesh_of(solid), DEFAULT_COLOUR, Finish::default());
    }
    surface
}

fn mesh_of(solid: &SolidPart) -> TriMesh {
    match solid {
        SolidPart::Mesh(mesh) => mesh.clone(),
        SolidPart::Primitive(shape, place) => {
            let mut mesh = shape.tessellate();
            mesh.transform(place);
            mesh
        }
    }
}

fn resting_of(solids: &[SolidPart]) -> Resting {
    let mut resting = Resting::default();
    for solid in solids {
        let part = match solid {
            SolidPart::Primitive(shape, place) => Resting::on_primitive(shape, place),
            SolidPart::Mesh(mesh) => Resting::on_corners(&support_points(mesh)),
        };
        resting.0.extend(part.0);
    }
    resting
}

fn hull_of(solids: &[SolidPart], name: &str) -> Result<TriMesh, ObjectError> {
    let points: Vec<glam::DVec3> = solids.iter().flat_map(|solid| mesh_of(solid).points).collect();
    palpate_geometry::convex_hull(&points).map_err(|cause| ObjectError::unsound(name, &cause))
}
