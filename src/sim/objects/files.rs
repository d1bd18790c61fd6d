//! Files of an object, and references between them.

use palpate_geometry::read_regular;
use std::path::{Component, Path, PathBuf};

/// Files beyond this size are not read (bytes).
const LARGEST_FILE: u64 = 256 << 20;

/// Extensions that a URDF or OBJ may refer to; nothing else is ever opened on its behalf.
const READABLE: [&str; 3] = ["obj", "stl", "mtl"];

/// Reads a file on behalf of the user: regular files of bearable size only.
pub(super) fn read_file(path: &Path) -> std::io::Result<Vec<u8>> {
    read_regular(path, LARGEST_FILE)
}

/// Reads a file that another file refers to: only meshes and their materials.
pub(super) fn read_referenced(path: &Path) -> std::io::Result<Vec<u8>> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    if READABLE.contains(&extension.as_str()) {
        read_file(path)
    } else {
        Err(std::io::Error::other("only .obj, .stl and .mtl files are read on behalf of an object"))
    }
}

/// Places where a mesh reference of a URDF in `folder` may lie, in the order in which they are tried.
///
/// - `package://NAME/rest`, `model://NAME/rest`: `rest` under any folder above that is called NAME or holds one called
///   NAME, under `share` of the entries of AMENT_PREFIX_PATH, under the entries of ROS_PACKAGE_PATH, then under the URDF's own
///   folders
/// - `file:///path`, absolute and relative paths: unchanged, relative ones from the URDF's folder
/// - all of these with `%20` and backslashes decoded
pub(super) fn candidates(reference: &str, folder: &Path) -> Vec<PathBuf> {
    let reference = reference.trim();
    if reference.is_empty() {
        return Vec::new();
    }
    let plain = plain_candidates(reference, folder);
    // As other systems write it: with escapes, or with backslashes.
    let written = percent_decoded(reference).replace('\\', "/");
    if written == reference { plain } else { plain.into_iter().chain(plain_candidates(&written, folder)).collect() }
}

/// A text in which `%20` and the like are the characters that they stand for.
fn percent_decoded(text: &str) -> String {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((first, others)) = rest.split_first() {
        let code = (*first == b'%').then(|| others.get(..2)).flatten().and_then(|pair| std::str::from_utf8(pair).ok());
        rest = match code.and_then(|pair| u8::from_str_radix(pair, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                &others[2..]
            }
            None => {
                bytes.push(*first);
                others
            }
        };
    }
    String::from_utf8(bytes).unwrap_or_else(|_| text.to_owned())
}

/// The only file beside a path whose name differs from its own in capitals alone.
pub(super) fn in_another_case(path: &Path) -> Option<PathBuf> {
    let wanted = path.file_name()?.to_str()?.to_lowercase();
    let alike =
        |entry: &std::fs::DirEntry| entry.file_name().to_str().is_some_and(|name| name.to_lowercase() == wanted);
    let mut found =
        std::fs::read_dir(path.parent()?).ok()?.filter_map(Result::ok).filter(alike).map(|entry| entry.path());
    found.next().filter(|_| found.next().is_none())
}

fn plain_candidates(reference: &str, folder: &Path) -> Vec<PathBuf> {
    if let Some(path) =
        ["file://localhost/", "file:///", "file:/"].iter().find_map(|scheme| reference.strip_prefix(scheme))
    {
        return vec![Path::new("/").join(path)];
    }
    if let Some(path) = reference.strip_prefix("file:") {
        return vec![folder.join(path)];
    }
    let in_package = ["package://", "model://"].iter().find_map(|scheme| reference.strip_prefix(scheme));
    let Some(in_package) = in_package else {
        return vec![folder.join(reference)];
    };
    let (package, rest) = in_package.split_once('/').unwrap_or(("", in_package));
    let mut found = Vec::new();
    let absolute = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    for above in absolute.ancestors() {
        if above.file_name().is_some_and(|name| name == package) {
            found.push(above.join(rest));
        }
        found.push(above.join(package).join(rest));
    }
    if let Some(paths) = std::env::var_os("AMENT_PREFIX_PATH") {
        found.extend(std::env::split_paths(&paths).map(|prefix| prefix.join("share").join(package).join(rest)));
    }
    if let Some(paths) = std::env::var_os("ROS_PACKAGE_PATH") {
        for root in std::env::split_paths(&paths) {
            if root.file_name().is_some_and(|name| name == package) {
                found.push(root.join(rest));
            }
            found.push(root.join(package).join(rest));
        }
    }
    // Objects copied out of their package keep its layout beside them, or one level up.
    found.extend(absolute.ancestors().take(2).map(|above| above.join(rest)));
    found
}

/// A path without `.` and `..`, as text that names a file inside a tree of embedded files; `None` if it leaves it.
pub(super) fn inside(path: &Path) -> Option<String> {
    let mut parts: Vec<&str> = Vec::new();
    for component in path.components() {
        match component {
            Component::Normal(part) => parts.push(part.to_str()?),
            Component::CurDir => {}
            Component::ParentDir => {
                parts.pop()?;
            }
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_are_sought_upwards() {
        let found = candidates("package://mug_description/meshes/mug.stl", Path::new("/ws/src/mug_description/urdf"));
        // Windows adds the letter of the drive.
        let wanted = std::path::absolute("/ws/src/mug_description/meshes/mug.stl").expect("a path");
        assert!(found.contains(&wanted), "{found:?}");
        assert_eq!(candidates("../meshes/a.obj", Path::new("/x/urdf")), [PathBuf::from("/x/urdf/../meshes/a.obj")]);
        for uri in ["file:///m/a.obj", "file:/m/a.obj", "file://localhost/m/a.obj"] {
            assert_eq!(candidates(uri, Path::new("/x")), [PathBuf::from("/m/a.obj")]);
        }
        let escaped = candidates("my%20parts\\a%c3%b6.obj", Path::new("/x"));
        assert!(escaped.contains(&PathBuf::from("/x/my parts/aö.obj")), "{escaped:?}");
        assert_eq!(percent_decoded("100%.stl"), "100%.stl");
    }

    #[test]
    fn only_meshes_are_read_for_others() {
        assert!(read_referenced(Path::new("/etc/passwd")).is_err());
        assert!(read_file(Path::new("/dev/zero")).is_err());
        assert!(read_file(Path::new("/")).is_err());
    }

    #[test]
    fn embedded_paths_stay_inside() {
        assert_eq!(inside(Path::new("lemon/./x/../lemon.obj")).as_deref(), Some("lemon/lemon.obj"));
        assert_eq!(inside(Path::new("lemon/../../etc/passwd")), None);
        assert_eq!(inside(Path::new("/etc/passwd")), None);
    }
}
