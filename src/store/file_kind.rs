//! Kinds of files that people name, and which files that are there already one of them may replace.

use std::fs::{File, symlink_metadata};
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// What a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// Animated PNG.
    Apng,
    BoardLines,
    /// Captured bytes of a board.
    Capture,
    /// Contacts of a simulated trial, as CSV.
    Contacts,
    /// Table as text.
    Csv,
    /// Animated GIF.
    Gif,
    Json,
    /// Recognition model of this program.
    Model,
    /// PNG picture.
    Png,
    Scene,
    /// SVG figure.
    Svg,
    /// Format of another program.
    Other {
        /// Name on screen.
        title: &'static str,
        /// Endings of its names, without the dot.
        endings: &'static [&'static str],
        /// First bytes.
        begin: &'static [u8],
    },
}

/// Bytes at the beginning of a file by which its kind is known.
const HEAD: u64 = 4096;

impl FileKind {
    /// All kinds but those of other programs.
    pub const ALL: [Self; 11] = [
        Self::Apng,
        Self::BoardLines,
        Self::Capture,
        Self::Contacts,
        Self::Csv,
        Self::Gif,
        Self::Json,
        Self::Model,
        Self::Png,
        Self::Scene,
        Self::Svg,
    ];

    /// Endings of its names, without the dot.
    pub fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Apng => &["apng", "png"],
            Self::BoardLines => &["txt", "log"],
            Self::Capture => &["bytes"],
            Self::Contacts | Self::Csv => &["csv"],
            Self::Gif => &["gif"],
            Self::Json => &["json"],
            Self::Model => &["safetensors"],
            Self::Png => &["png"],
            Self::Scene => &["toml"],
            Self::Svg => &["svg"],
            Self::Other { endings, .. } => endings,
        }
    }

    /// The one of several that the ending of a name stands for.
    pub fn of(path: &Path, kinds: &[Self]) -> Option<Self> {
        let own = path.extension()?;
        kinds.iter().copied().find(|kind| kind.endings().iter().any(|known| own.eq_ignore_ascii_case(known)))
    }

    fn title(self) -> &'static str {
        match self {
            Self::Apng | Self::Png => "PNG picture",
            Self::BoardLines => "list of a board's lines",
            Self::Capture => "capture of a board's bytes",
            Self::Contacts => "table of contacts",
            Self::Csv => "CSV table",
            Self::Gif => "GIF picture",
            Self::Json => "JSON file",
            Self::Model => "model of Palpate",
            Self::Scene => "scene",
            Self::Svg => "SVG figure",
            Self::Other { title, .. } => title,
        }
    }

    /// True for the beginning of such a file, and for an empty one.
    fn begins(self, head: &[u8]) -> bool {
        let line = || String::from_utf8_lossy(head).trim_start_matches('\u{feff}').trim_start().to_owned();
        let is_text = !head.contains(&0);
        head.is_empty()
            || match self {
                Self::Apng | Self::Png => head.starts_with(b"\x89PNG\r\n\x1a\n"),
                Self::BoardLines => head.starts_with(b"# tactile-gripper "),
                Self::Capture => head.starts_with(palpate_tactile::capture::CAPTURE_MAGIC),
                Self::Contacts => head.starts_with(b"t_s,finger,segment,taxel"),
                Self::Csv => is_text && line().lines().next().is_some_and(|first| first.contains([',', ';', '\t'])),
                Self::Gif => head.starts_with(b"GIF8"),
                Self::Json => is_text && line().starts_with(['{', '[']),
                Self::Model => head.get(8..).is_some_and(|rest| rest.starts_with(br#"{"__metadata__":{"palpate""#)),
                Self::Scene => is_text && line().lines().any(is_toml),
                Self::Svg => is_text && line().starts_with('<') && line().contains("<svg"),
                Self::Other { begin, .. } => head.starts_with(begin),
            }
    }
}

/// True for a table or a value of TOML.
fn is_toml(line: &str) -> bool {
    line.strip_prefix('[').is_some_and(|rest| rest.starts_with(char::is_alphabetic)) || line.contains(" = ")
}

/// Refuses a name to which a file of this kind may not be written: that of a store or of a part of one, of a file of another
/// kind, of a folder or a device. A symbolic link is replaced, unless it leads to a store.
pub fn check_target(path: &Path, kind: FileKind) -> io::Result<()> {
    refusal(path, kind)?.map_or(Ok(()), |refusal| Err(io::Error::other(refusal)))
}

/// Reason why a name is not written to.
fn refusal(path: &Path, kind: FileKind) -> io::Result<Option<String>> {
    if is_store(path)? {
        return Ok(Some("it is a store of trials; choose another name".to_owned()));
    }
    if let Some(store) = store_with_part(path) {
        let store = store.display();
        return Ok(Some(format!("it belongs to the store \"{store}\"; choose another name")));
    }
    let there = match symlink_metadata(path) {
        Err(cause) if cause.kind() == ErrorKind::NotFound => return Ok(None),
        there => there?.file_type(),
    };
    Ok(if there.is_dir() {
        Some("it is a folder; choose the name of a file".to_owned())
    } else if there.is_symlink() {
        None
    } else if !there.is_file() {
        Some("it is neither a file nor a folder; choose another name".to_owned())
    } else {
        let other = || {
            format!("there is a file of this name which is no {}; choose another name, or move it away", kind.title())
        };
        (!kind.begins(&head(path, HEAD)?)).then(other)
    })
}

/// True for an SQLite file, also for one whose content is still in the log beside it.
fn is_store(path: &Path) -> io::Result<bool> {
    let with = |suffix: &str| {
        let mut name = path.as_os_str().to_owned();
        name.push(suffix);
        std::fs::metadata(name).is_ok_and(|part| part.len() > 0)
    };
    Ok(path.is_file() && (head(path, 16)?.starts_with(b"SQLite format 3\0") || PARTS.into_iter().any(with)))
}

/// Suffixes of the files that SQLite keeps beside a store.
pub(super) const PARTS: [&str; 3] = ["-wal", "-shm", "-journal"];

/// The store beside which SQLite keeps a file of this name.
fn store_with_part(path: &Path) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let store = PARTS.iter().find_map(|suffix| name.strip_suffix(suffix)).map(|name| path.with_file_name(name))?;
    is_store(&store).is_ok_and(|is| is).then_some(store)
}

fn head(path: &Path, length: u64) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    File::open(path)?.take(length).read_to_end(&mut head)?;
    Ok(head)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NPZ: FileKind = FileKind::Other { title: "NPZ archive", endings: &["npz"], begin: b"PK" };

    #[test]
    fn stores_and_what_belongs_to_them_are_never_a_target() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let at = |name: &str| folder.path().join(name);
        let store = crate::Store::open(&at("own.csv"))?;
        std::fs::write(at("fresh.json"), "")?;
        std::fs::write(at("fresh.json-wal"), "pages")?;
        #[cfg(unix)]
        std::os::unix::fs::symlink("own.csv", at("link.csv"))?;
        for kind in FileKind::ALL {
            let message = |name: &str| check_target(&at(name), kind).err().map(|error| error.to_string());
            assert!(message("own.csv").is_some_and(|text| text.contains("is a store")), "{kind:?}");
            assert!(message("fresh.json").is_some_and(|text| text.contains("is a store")), "{kind:?}");
            assert!(message("own.csv-wal").is_some_and(|text| text.contains("belongs to the store")), "{kind:?}");
            assert!(cfg!(not(unix)) || message("link.csv").is_some_and(|text| text.contains("is a store")), "{kind:?}");
            assert!(message("new.csv").is_none() && message("other.csv-wal").is_none());
            assert!(message("").is_some_and(|text| text.contains("is a folder")), "{kind:?}");
        }
        drop(store);
        Ok(())
    }

    #[test]
    fn each_kind_replaces_its_own_and_no_other() -> io::Result<()> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("there");
        let own: [(&[FileKind], &[u8]); 11] = [
            (&[FileKind::Apng, FileKind::Png], b"\x89PNG\r\n\x1a\n...."),
            (&[FileKind::BoardLines], b"# tactile-gripper fw=2 adc=12"),
            (&[FileKind::Capture], b"PPB1\0"),
            (&[FileKind::Contacts, FileKind::Csv], b"t_s,finger,segment,taxel,x [m]\n0,left,1,1,0\n"),
            (&[FileKind::Csv], b"\xef\xbb\xbft_s;a\n0;1\n"),
            (&[FileKind::Gif], b"GIF89a"),
            (&[FileKind::Json], b"\n [{}]"),
            (&[FileKind::Model], b"\x40\0\0\0\0\0\0\0{\"__metadata__\":{\"palpate\":\"{}\"}}"),
            (&[NPZ], b"PK\x03\x04"),
            (&[FileKind::Scene], b"# mine\n[object]\nsource = \"lemon\"\n"),
            (&[FileKind::Svg], b"<?xml version=\"1.0\"?>\n<svg/>"),
        ];
        let foreign: [&[u8]; 3] = [b"dear diary", b"\x40\0\0\0\0\0\0\0{\"a\":{\"dtype\":\"F32\"}}", b"\x7fELF\x02\0,,"];
        for (kinds, bytes) in own.into_iter().chain(foreign.map(|bytes| (&[][..], bytes))) {
            std::fs::write(&path, bytes)?;
            for kind in FileKind::ALL.into_iter().chain([NPZ]) {
                let outcome = check_target(&path, kind);
                assert_eq!(outcome.is_ok(), kinds.contains(&kind), "{kind:?} over {bytes:?}: {outcome:?}");
            }
        }
        std::fs::write(&path, "")?;
        assert!(
            FileKind::ALL.into_iter().all(|kind| check_target(&path, kind).is_ok()),
            "nothing is lost with an empty file"
        );
        Ok(())
    }

    #[test]
    fn an_ending_names_a_kind() {
        let of = |name: &str| FileKind::of(Path::new(name), &[FileKind::Svg, FileKind::Png]);
        assert_eq!(
            [of("a.PNG"), of("b.svg"), of("c.jpg"), of("png")],
            [Some(FileKind::Png), Some(FileKind::Svg), None, None]
        );
    }
}
