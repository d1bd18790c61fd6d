//! Objects as other programs write them: what each file of `tests/suite/cases/objects` gives, frozen, and the same files
//! changed as editors and exporters change them. Each was made after a public report; its name begins with the number of the
//! case.

use crate::frozen::compare;
use crate::program::palpate;
use palpate_sim::objects::{LoadOptions, ObjectModel, load};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The files under their real names, which repositories do not keep well.
fn cases() -> (tempfile::TempDir, Vec<PathBuf>) {
    let folder = tempfile::tempdir().unwrap();
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/suite/cases/objects");
    let mut files = Vec::new();
    copy(&from, folder.path(), &mut files);
    files.sort();
    (folder, files)
}

fn copy(from: &Path, to: &Path, files: &mut Vec<PathBuf>) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        let to = to.join(name.replace("a08_unicode", "a08 kör per").replace("teil_ae", "teil ä"));
        if entry.path().is_dir() {
            copy(&entry.path(), &to, files);
            continue;
        }
        let bytes = std::fs::read(entry.path()).unwrap();
        let folder = to.parent().unwrap().to_str().unwrap().to_owned();
        let bytes = match String::from_utf8(bytes) {
            Ok(text) if text.contains("FOLDER") => text.replace("FOLDER", &folder).into_bytes(),
            Ok(text) => text.into_bytes(),
            Err(other) => other.into_bytes(),
        };
        std::fs::write(&to, bytes).unwrap();
        files.push(to);
    }
}

fn ending(file: &Path) -> String {
    file.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

fn read(file: &Path) -> Result<ObjectModel, String> {
    let read = load(file.to_str().unwrap(), &LoadOptions::default()).map_err(|error| error.to_string())?;
    Ok(read.expect("a file is never an empty hand"))
}

#[test]
fn files_of_others_are_read_or_say_why_not() {
    let (folder, files) = cases();
    let mut text = String::new();
    for file in files.iter().filter(|file| ["urdf", "obj", "stl", "dae", "glb"].contains(&ending(file).as_str())) {
        let name = file.strip_prefix(folder.path()).unwrap().display();
        match read(file) {
            Ok(object) => {
                let (grams, size) = (1e3 * object.mass.mass, object.bounds.size() * 1e3);
                let friction = object.friction;
                writeln!(
                    text,
                    "{name}: {grams:.2} g, {:.2} x {:.2} x {:.2} mm, friction {friction}",
                    size.x, size.y, size.z
                )
                .unwrap();
                object.warnings.iter().for_each(|warning| writeln!(text, "    {warning}").unwrap());
            }
            Err(why) => writeln!(text, "{name}: refused\n    {why}").unwrap(),
        }
    }
    compare("cases_objects", &text.replace(folder.path().to_str().unwrap(), "FOLDER"));
}

#[test]
fn packages_are_found_in_an_installed_workspace() {
    let (folder, _) = cases();
    let store = folder.path().join("trials.sqlite");
    let grasp = |workspace: &str| {
        let mut command = palpate(&store);
        command.args(["grasp", "a07_elsewhere/part.urdf", "--no-store"]).current_dir(folder.path());
        command.env("AMENT_PREFIX_PATH", folder.path().join(workspace)).output().unwrap()
    };
    assert!(grasp("a07_ws/install/kit").status.success());
    let refused = grasp("a07_ws/install");
    assert!(!refused.status.success() && String::from_utf8_lossy(&refused.stderr).contains("AMENT_PREFIX_PATH"));
}

/// What an object is, to the last bit.
fn essence(object: &ObjectModel) -> Vec<u64> {
    let (mass, bounds) = (&object.mass, &object.bounds);
    let mut numbers = vec![mass.mass, object.friction];
    numbers.extend([mass.centre, bounds.min, bounds.max].iter().flat_map(|v| v.to_array()));
    numbers.extend(mass.inertia.to_cols_array());
    // Distances from places around it, which the solids give.
    for k in 0..64u32 {
        let corner = |bit: u32, axis: usize| {
            let part = f64::from((k >> (2 * bit)) & 3) / 3.0 * 1.2 - 0.1;
            bounds.min.to_array()[axis] + part * bounds.size().to_array()[axis]
        };
        numbers.push(object.field.distance(glam::DVec3::new(corner(0, 0), corner(1, 1), corner(2, 2))));
    }
    numbers.into_iter().map(f64::to_bits).collect()
}

/// A change that leaves an object as it is.
type Change = (&'static str, fn(&str) -> Vec<u8>);

const OF_TEXT: [Change; 3] = [
    ("a byte-order mark", |text| [b"\xEF\xBB\xBF", text.as_bytes()].concat()),
    ("CRLF", |text| text.replace('\n', "\r\n").into_bytes()),
    ("blank lines at the end", |text| format!("{text}\n\n").into_bytes()),
];

const OF_OBJ: [Change; 5] = [
    ("CR alone", |text| text.replace('\n', "\r").into_bytes()),
    ("comments", |text| text.lines().map(|line| format!("{line} # text\n")).collect::<String>().into_bytes()),
    ("tabs", |text| text.replace(' ', "\t").into_bytes()),
    ("continued lines", |text| {
        let continued =
            |line: &str| if line.starts_with("f ") { line.replacen(' ', " \\\n ", 2) } else { line.to_owned() };
        text.lines().map(|line| continued(line) + "\n").collect::<String>().into_bytes()
    }),
    ("groups and smoothing", |text| text.replacen("\nf ", "\ng other\ns off\nf ", 1).into_bytes()),
];

const OF_STL: [Change; 5] = [
    ("capitals", |text| text.to_ascii_uppercase().into_bytes()),
    ("CR alone", |text| text.replace('\n', "\r").into_bytes()),
    ("indents", |text| text.lines().map(|line| format!("\t  {line}  \n")).collect::<String>().into_bytes()),
    ("normals that are no numbers", |text| {
        let without = |line: &str| {
            if line.trim_start().starts_with("facet") { "facet normal nan nan nan".to_owned() } else { line.to_owned() }
        };
        text.lines().map(|line| without(line) + "\n").collect::<String>().into_bytes()
    }),
    ("two words", |text| text.replace("endloop", "end loop").replace("endfacet", "end facet").into_bytes()),
];

const OF_URDF: [Change; 4] = [
    ("UTF-16", |text| {
        let text = text
            .replace("encoding=\"utf-8\"", "encoding=\"utf-16\"")
            .replace("encoding=\"UTF-8\"", "encoding=\"UTF-16\"");
        [0xFF, 0xFE].into_iter().chain(text.encode_utf16().flat_map(u16::to_le_bytes)).collect()
    }),
    ("comments", |text| text.replacen("<link", "<!-- text --><link", 1).into_bytes()),
    ("blanks in tags", |text| text.replace("/>", "\n  />").into_bytes()),
    ("elements in another order", |text| {
        // The last element before the first.
        let (Some(first), Some(last)) = (text.find("<link"), text.rfind("<link")) else { return text.into() };
        let Some(end) = text[last..].find("</link>").map(|end| last + end + "</link>".len()) else {
            return text.into();
        };
        if first == last {
            text.into()
        } else {
            [&text[..first], &text[last..end], &text[first..last], &text[end..]].concat().into_bytes()
        }
    }),
];

#[test]
fn harmless_changes_change_nothing() {
    let (folder, files) = cases();
    let mut changed = BTreeSet::new();
    for file in &files {
        let own = ending(file);
        let Ok(bytes) = std::fs::read(file) else { continue };
        let Ok(text) = String::from_utf8(bytes) else { continue };
        // A file with an oddity of its own is no plain text to change.
        let is_plain = text.is_ascii() && !text.contains(['\r', '\\', '\0']) && text.lines().count() > 1;
        let special: &[Change] = match own.as_str() {
            "obj" => &OF_OBJ,
            "stl" if text.starts_with("solid") => &OF_STL,
            "urdf" => &OF_URDF,
            _ => continue,
        };
        let Some(object) = read(file).ok().filter(|_| is_plain) else { continue };
        let wanted = essence(&object);
        for (what, change) in OF_TEXT.iter().chain(special) {
            let beside = file.with_file_name(format!("changed.{own}"));
            std::fs::write(&beside, change(&text)).unwrap();
            let name = file.strip_prefix(folder.path()).unwrap().display();
            let object = read(&beside).unwrap_or_else(|why| panic!("{name} with {what}: {why}"));
            assert!(essence(&object) == wanted, "{name} with {what} is another object");
            std::fs::remove_file(&beside).unwrap();
            changed.insert((own.clone(), *what));
        }
    }
    assert_eq!(changed.len(), 3 * OF_TEXT.len() + OF_OBJ.len() + OF_STL.len() + OF_URDF.len(), "{changed:?}");
}
