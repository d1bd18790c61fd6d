//! Files that people name: what is read of them, as text or bytes, and what they hold in place of what their names say.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

/// Opens a regular file: devices and pipes may never end, or never begin.
pub fn open_regular(path: &Path) -> io::Result<File> {
    let about = std::fs::metadata(path)?;
    if !about.is_file() {
        let what =
            if about.is_dir() { "it is a directory" } else { "it is not a regular file, but a device or a pipe" };
        return Err(io::Error::other(what));
    }
    File::open(path)
}

/// Reads a regular file of at most so many bytes.
pub fn read_regular(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open_regular(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let limit = if most < 1 << 20 { format!("{} KiB", most >> 10) } else { format!("{} MiB", most >> 20) };
        return Err(io::Error::other(format!("it is too large; the limit is {limit}")));
    }
    Ok(bytes)
}

/// Reads a regular file of at most so many bytes, which has to be text in UTF-8.
pub fn read_text(path: &Path, most: u64) -> io::Result<String> {
    String::from_utf8(read_regular(path, most)?).map_err(|_utf8| io::Error::other("it is not text in UTF-8"))
}

/// The text of a file: UTF-8, UTF-16 with a byte-order mark, or Latin-1 where it is neither; without a mark.
pub fn text_of(bytes: &[u8]) -> String {
    let wide = |from: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes[2..].as_chunks().0.iter().map(|pair| from(*pair)).collect();
        String::from_utf16_lossy(&units)
    };
    match bytes {
        [0xFF, 0xFE, ..] => wide(u16::from_le_bytes),
        [0xFE, 0xFF, ..] => wide(u16::from_be_bytes),
        [0xEF, 0xBB, 0xBF, rest @ ..] => String::from_utf8_lossy(rest).into_owned(),
        _ => std::str::from_utf8(bytes)
            .map_or_else(|_| bytes.iter().map(|byte| char::from(*byte)).collect(), str::to_owned),
    }
}

/// What a file holds instead of what its name says, and the remedy: what version control and browsers leave behind.
pub fn other_content(bytes: &[u8]) -> Option<&'static str> {
    let head = &bytes[..bytes.len().min(200)];
    let text = String::from_utf8_lossy(head).trim_start_matches('\u{feff}').trim_start().to_ascii_lowercase();
    if bytes.is_empty() {
        Some("the file is empty")
    } else if text.starts_with("version https://git-lfs") {
        Some("it is a Git LFS pointer in place of the file; run `git lfs pull` where it comes from")
    } else if text.starts_with("<!doctype html") || text.starts_with("<html") {
        Some("it is a web page in place of the file; download the file itself (\"raw\")")
    } else if bytes.starts_with(b"glTF") {
        Some("it is a GLB file; export it as OBJ or STL")
    } else if text.starts_with("iso-10303-21") {
        Some("it is a STEP file; export it as STL or OBJ")
    } else if text.starts_with("ply\n") || text.starts_with("ply\r") {
        Some("it is a PLY file; export it as STL or OBJ")
    } else if bytes.starts_with(b"PK\x03\x04") && (text.contains("3d/") || text.contains(".model")) {
        Some("it is a 3MF archive; export it as STL or OBJ")
    } else if text.contains("[content_types].xml") || text.contains("xl/") {
        Some(
            "it is an archive of another program, such as 3MF or a spreadsheet; export a mesh as STL or OBJ, a sheet as CSV",
        )
    } else if bytes.starts_with(b"PK\x03\x04") {
        Some("it is a ZIP archive; unpack it first")
    } else if bytes.starts_with(b"\x89HDF") {
        Some("it is an HDF5 file; export its arrays as NPZ, or tables as CSV")
    } else if bytes.starts_with(b"\x93NUMPY") {
        Some("it is a single array of numpy; save it with its times as NPZ")
    } else if bytes.starts_with(b"SQLite format 3") {
        Some("it is an SQLite database; a store of Palpate is joined with `palpate trials merge`")
    } else if bytes.starts_with(&[0x1f, 0x8b]) {
        Some("it is compressed by gzip; unpack it first")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regular_files_are_read_up_to_a_limit_and_nothing_else() -> io::Result<()> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("a");
        std::fs::write(&path, "0123")?;
        assert_eq!(read_text(&path, 4)?, "0123");
        assert!(read_text(&path, 3).is_err_and(|cause| cause.to_string().contains("too large")));
        std::fs::write(&path, [0xff, 0])?;
        assert!(read_text(&path, 4).is_err_and(|cause| cause.to_string().contains("UTF-8")));
        assert!(read_regular(folder.path(), 4).is_err());
        if cfg!(unix) {
            for endless in ["/dev/zero", "/dev/random"] {
                assert!(read_regular(Path::new(endless), 4).is_err_and(|cause| cause.to_string().contains("regular")));
            }
        }
        Ok(())
    }

    #[test]
    fn texts_are_decoded_and_other_contents_are_named() {
        assert_eq!(text_of(b"\xEF\xBB\xBFa"), "a");
        assert_eq!(text_of(b"\xFF\xFEa\0\xE4\0"), "a\u{e4}");
        assert_eq!(text_of(b"a\xE4"), "a\u{e4}");
        assert!(other_content(b"ISO-10303-21;\nHEADER;").is_some_and(|text| text.contains("STEP")));
        assert_eq!(other_content(b""), Some("the file is empty"));
        assert!(other_content(b"PK\x03\x04").is_some() && other_content(b"solid").is_none());
    }
}
