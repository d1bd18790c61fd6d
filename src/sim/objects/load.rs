//! Finding an object by what the user wrote: a built-in name, or a URDF, OBJ or STL file.

use super::assemble::{Blueprint, ShapeSource};
use super::catalogue::{BuiltIn, catalogue, read_embedded};
use super::files::{candidates, in_another_case, read_file, read_referenced};
use super::options::LoadOptions;
use super::{ObjectError, ObjectModel, RandomShape, urdf};
use palpate_geometry::{MeshFileError, Pose, SurfaceMesh, read_mesh};
use std::cell::Cell;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// The name that stands for an empty hand.
pub const EMPTY: &str = "empty";

/// Title of an object, by the name of its class: that of a built-in one or of a random shape, or else the name with spaces
/// for underscores.
pub fn object_title(name: &str) -> String {
    if let Some(seed) = RandomShape::seed_of(name) {
        return format!("Random shape {seed}");
    }
    let built_in = catalogue().iter().find(|built_in| built_in.name == name).map(|built_in| built_in.title.as_str());
    built_in.map_or_else(|| if name == EMPTY { "Empty hand".to_owned() } else { name.replace('_', " ") }, str::to_owned)
}

/// Title as lists and headings have it, with a capital: `Mug` for an object of a file `mug.obj`.
pub fn capital_title(name: &str) -> String {
    palpate_geometry::units::capital(&object_title(name))
}

/// Name of the class of the object with this name or title; the text itself where there is none.
pub fn class_of(text: &str) -> &str {
    let text = text.trim();
    let is = |own: &str| own.to_lowercase() == text.to_lowercase();
    let built_in = catalogue().iter().find(|b| is(&b.name)).or_else(|| catalogue().iter().find(|b| is(&b.title)));
    built_in.map_or(if is("Empty hand") { EMPTY } else { text }, |b| b.name.as_str())
}

/// Title of an object with the name of its class behind it, where the two differ: `Tennis ball (bigball)`.
pub fn titled(name: &str) -> String {
    let title = object_title(name);
    if title.to_lowercase() == name.replace('_', " ").to_lowercase() { title } else { format!("{title} ({name})") }
}

/// True for the path of a file, false for the name of a built-in object, of a random shape or of the empty hand.
pub fn is_file(source: &str) -> bool {
    source != EMPTY && RandomShape::seed_of(source).is_none() && !catalogue().iter().any(|b| b.name == source)
}

/// A source that names the same object from any folder: files that exist get their whole path, titles of built-in objects
/// become names, and names stay.
pub fn anchored(source: &str) -> String {
    let named = source == EMPTY || catalogue().iter().any(|b| b.name == source);
    let whole = std::path::absolute(source).ok().filter(|path| !named && path.exists());
    whole.and_then(|path| path.to_str().map(str::to_owned)).unwrap_or_else(|| class_of(source).to_owned())
}

/// Hash of files, in the order in which they are read.
#[derive(Default)]
struct Content(Cell<u64>);

impl Content {
    /// Adds the bytes of a file that could be read.
    fn of(&self, read: std::io::Result<Vec<u8>>) -> std::io::Result<Vec<u8>> {
        read.inspect(|bytes| self.add(bytes))
    }

    fn add(&self, bytes: &[u8]) {
        self.0.set(crate::fingerprint([self.0.get().to_le_bytes().as_slice(), bytes]));
    }

    /// Stores the hash in the object that was made of the files.
    fn stamped(self, object: ObjectModel) -> ObjectModel {
        ObjectModel { content: self.0.get(), ..object }
    }
}

/// Loads a built-in object or a [`RandomShape`] by name, or a URDF, OBJ or STL file by path; `None` for an empty hand.
pub fn load(source: &str, options: &LoadOptions) -> Result<Option<ObjectModel>, ObjectError> {
    if source == EMPTY {
        return Ok(None);
    }
    if let Some(built_in) = catalogue().iter().find(|b| b.name == source) {
        return built_in_object(built_in, options).map(Some);
    }
    if let Some(shape) = RandomShape::named(source) {
        return shape.build(options).map(Some);
    }
    let content = Content::default();
    let path = Path::new(source);
    let blueprint = blueprint(source, &content)?;
    let name = class_in(path, blueprint.robot.as_deref());
    let object = ObjectModel { name, ..blueprint.build(options)? };
    // The same file in another unit is another object.
    options.scale.iter().for_each(|scale| content.add(&scale.to_le_bytes()));
    Ok(Some(content.stamped(object)))
}

/// Surface of the object in a URDF, OBJ or STL file, in the file's own units. It may be open or tangled: it is for looking
/// at only.
pub fn load_surface(source: &str) -> Result<SurfaceMesh, ObjectError> {
    Ok(blueprint(source, &Content::default())?.surface())
}

fn blueprint(source: &str, content: &Content) -> Result<Blueprint, ObjectError> {
    let path = Path::new(source);
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "urdf" | "xml" => read_urdf(path, content),
        "obj" | "stl" => read_mesh_file(path, content),
        _ => Err(unknown(source, path, &extension)),
    }
}

fn unknown(source: &str, path: &Path, extension: &str) -> ObjectError {
    if path.is_dir() {
        return ObjectError(format!("\"{source}\" is a folder; name the .urdf, .obj or .stl file in it"));
    }
    if path.exists() || !extension.is_empty() {
        let kind = if extension.is_empty() { "typeless".to_owned() } else { format!(".{extension}") };
        return ObjectError(format!("\"{source}\" is a {kind} file; Palpate reads objects from .urdf, .obj and .stl"));
    }
    let names = || catalogue().iter().map(|b| b.name.as_str());
    let nearest = names()
        .map(|name| (strsim::jaro_winkler(&source.to_ascii_lowercase(), name), name))
        .filter(|(likeness, _)| *likeness > 0.7)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name);
    let titled = Some(class_of(source)).filter(|name| *name != source);
    let hint = match titled.or(nearest) {
        Some(name) => format!("did you mean \"{name}\"?"),
        None => {
            format!("there are {}, {EMPTY}, or any .urdf, .obj or .stl file", names().collect::<Vec<_>>().join(", "))
        }
    };
    ObjectError(format!("there is no object \"{source}\": {hint}"))
}

/// Names that say nothing of what is in a file.
const GENERIC: [&str; 16] = [
    "model",
    "object",
    "robot",
    "untitled",
    "unnamed",
    "default",
    "part",
    "body",
    "mesh",
    "meshes",
    "urdf",
    "file",
    "files",
    "textured",
    "nontextured",
    "export",
];

/// True for a name that tells an object from others: `mug`, not `Model_2`.
fn is_telling(name: &str) -> bool {
    let word = name.trim_end_matches(|c: char| !c.is_alphabetic()).to_lowercase();
    !name.is_empty() && !GENERIC.contains(&word.as_str()) && name.len() <= 80 && !name.contains(char::is_control)
}

/// Class of the object in a file: the name that it has in the file, else the file's name, else that of its folder; the first
/// of them that is not generic.
fn class_in(path: &Path, robot: Option<&str>) -> String {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let folder = whole.parent().and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned());
    let mut names = robot.map(|name| name.trim().to_owned()).into_iter().chain([stem(path)]).chain(folder);
    names.find(|name| is_telling(name)).unwrap_or_else(|| stem(path))
}

/// Name of a file with its ending: files of several kinds may have one stem.
fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "object".to_owned(), |s| s.to_string_lossy().into_owned())
}

/// Built-in objects, each with the options that it was loaded with last. A demo or a study needs them again and again, and
/// baking the distances of one takes ten times as long as a grasp.
static LOADED: Mutex<Vec<(LoadOptions, ObjectModel)>> = Mutex::new(Vec::new());

fn built_in_object(built_in: &BuiltIn, options: &LoadOptions) -> Result<ObjectModel, ObjectError> {
    let loaded = || LOADED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, object)) = loaded().iter().find(|(with, object)| with == options && object.name == built_in.name) {
        return Ok(object.clone());
    }
    let object = load_built_in(&built_in.name, options)?;
    let object = ObjectModel { class: Some(built_in.class()), friction: built_in.friction, ..object };
    let mut loaded = loaded();
    loaded.retain(|(_, other)| other.name != object.name);
    loaded.push((*options, object.clone()));
    Ok(object)
}

fn load_built_in(name: &str, options: &LoadOptions) -> Result<ObjectModel, ObjectError> {
    let folder = Path::new(name);
    let file = folder.join(format!("{name}.urdf"));
    let content = Content::default();
    let bytes = content.of(read_embedded(&file)).map_err(|cause| unreadable(&file, &cause))?;
    let read = |path: &str| content.of(read_embedded(Path::new(path)));
    let mesh = |reference: &str| read_mesh(&folder.join(reference).to_string_lossy(), &read);
    let object = urdf::parse(name, &bytes, &mesh)?.build(options)?;
    Ok(content.stamped(object))
}

/// True for a path that begins with the letter of a drive.
fn of_windows(reference: &str) -> bool {
    let path = reference.trim_start_matches("file:").trim_start_matches('/');
    let mut letters = path.chars();
    !cfg!(windows) && letters.next().is_some_and(|c| c.is_ascii_alphabetic()) && letters.next() == Some(':')
}

fn read_urdf(path: &Path, content: &Content) -> Result<Blueprint, ObjectError> {
    let bytes = content.of(read_file(path)).map_err(|cause| unreadable(path, &cause))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let read = |path: &str| content.of(read_referenced(Path::new(path)));
    let mesh = |reference: &str| {
        let places = candidates(reference, folder);
        let found = places.iter().find(|place| place.is_file()).cloned();
        match found.or_else(|| places.iter().find_map(|place| in_another_case(place))) {
            Some(place) => read_mesh(&place.to_string_lossy(), &read),
            None if reference.to_ascii_lowercase().ends_with(".dae") => read_mesh(reference, &read),
            None => {
                let cause = match places.first() {
                    _ if of_windows(reference) => {
                        "it is a path of another computer; write it relative to the URDF, or as package://".to_owned()
                    }
                    Some(first) if reference.contains("://") && places.len() > 1 => format!(
                        "it is neither at {} nor at {} other places; name the folder above its package in ROS_PACKAGE_PATH, or \
                         an installed workspace in AMENT_PREFIX_PATH",
                        first.display(),
                        places.len() - 1
                    ),
                    Some(first) => format!("there is no file {}", first.display()),
                    None => "the reference is empty".to_owned(),
                };
                Err(MeshFileError::unreadable(reference, cause))
            }
        }
    };
    urdf::parse(&file_name(path), &bytes, &mesh)
}

fn read_mesh_file(path: &Path, content: &Content) -> Result<Blueprint, ObjectError> {
    let read = |path: &str| content.of(read_referenced(Path::new(path)));
    let parts = read_mesh(&path.to_string_lossy(), &read)?;
    let mut blueprint = Blueprint::new(&file_name(path));
    blueprint.add_visual(&ShapeSource::Mesh(parts), &Pose::IDENTITY, None);
    Ok(blueprint)
}

fn unreadable(path: &Path, cause: &std::io::Error) -> ObjectError {
    ObjectError(format!("cannot read \"{}\": {cause}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_class_has_the_first_name_that_tells_it_from_others() {
        let class = |path: &str, robot: Option<&str>| class_in(Path::new(path), robot);
        assert_eq!(class("/set/can/model.urdf", Some("tin")), "tin");
        assert_eq!(class("/set/can/Model_2.urdf", Some(" Robot ")), "can");
        assert_eq!(class("/downloads/mug.urdf", Some("object")), "mug");
        assert_eq!(class("/set/can/mesh.stl", None), "can");
        assert_eq!(class("/set/meshes/part1.stl", None), "part1", "nothing says more");
        assert_eq!(class("/set/can/mug.obj", Some("a\tb")), "mug");
        assert_eq!(class("/set/002.urdf", Some("")), "002");
    }

    #[test]
    fn a_built_in_object_is_loaded_once_for_the_same_options() {
        let load = |options: &LoadOptions| load("case", options).expect("loads").expect("an object");
        let (usual, heavy) = (LoadOptions::default(), LoadOptions { mass: Some(1.0), ..LoadOptions::default() });
        let first = load(&usual);
        assert!(std::sync::Arc::ptr_eq(&first.surface, &load(&usual).surface));
        let other = load(&heavy);
        assert!((other.mass.mass - 1.0).abs() < 1e-12 && !std::sync::Arc::ptr_eq(&first.surface, &other.surface));
        assert!((load(&usual).mass.mass - first.mass.mass).abs() < 1e-12);
    }

    #[test]
    fn objects_have_one_title() {
        assert_eq!(
            ["bigball", "lemon", EMPTY, "garlic"].map(object_title),
            ["Tennis ball", "Lemon", "Empty hand", "garlic"]
        );
        assert_eq!(["bigball", "lemon", "jam_jar"].map(titled), ["Tennis ball (bigball)", "Lemon", "jam jar"]);
        assert_eq!(["random:7", "random:x"].map(object_title), ["Random shape 7", "random:x"]);
        assert_eq!(
            ["tennis Ball", "ball", " Die ", "garlic"].map(class_of),
            ["bigball", "ball", "smallcube", "garlic"]
        );
        let mut titles: Vec<String> = catalogue().iter().map(|b| b.title.to_lowercase()).collect();
        titles.sort();
        titles.dedup();
        assert_eq!(titles.len(), catalogue().len());
    }
}
