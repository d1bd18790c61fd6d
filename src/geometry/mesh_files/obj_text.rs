//! The lines of an OBJ file that matter here, written so that tobj reads them: corners, faces and materials.
//!
//! Exporters put much more into these files: normals, texture places, lines, curves, remarks, line continuations. None of it
//! changes the solid, and each of it has made a reader fail. What does matter and cannot be read is refused with its line.

/// Rewrites a file; the error is a sentence with the line.
pub(super) fn cleaned(bytes: &[u8]) -> Result<String, String> {
    let text = crate::file::text_of(bytes);
    let mut out = String::with_capacity(text.len());
    let (mut corners, mut highest) = (0_i64, (0_i64, 0));
    let (mut faces, mut other) = (0, None);
    for (number, line) in whole_lines(&text) {
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((&line, ""));
        let rest = rest.trim();
        match word.to_ascii_lowercase().as_str() {
            "v" => {
                let values = without_remark(rest);
                let place: Vec<&str> = values.split_whitespace().take(3).collect();
                if place.len() < 3 {
                    return Err(format!(
                        "line {number}: \"{}\" is not the place of a corner, which has three numbers",
                        brief(&line)
                    ));
                }
                for value in &place {
                    if value.parse::<f32>().is_err() {
                        return Err(format!("line {number}: {}", no_number(value)));
                    }
                }
                corners += 1;
                out.push_str(&format!("v {}\n", place.join(" ")));
            }
            "f" | "fo" => {
                let mut face = String::from("f");
                let mut count = 0;
                for corner in without_remark(rest).split_whitespace() {
                    let index = corner.split('/').next().unwrap_or_default();
                    let Ok(index) = index.parse::<i64>() else {
                        return Err(format!(
                            "line {number}: \"{}\" is no corner of a face; one is a number, or numbers with / between",
                            brief(corner)
                        ));
                    };
                    // Negative ones count back from where the face stands.
                    let absolute = if index < 0 { corners + 1 + index } else { index };
                    if absolute < 1 {
                        return Err(format!(
                            "line {number}: the face names corner {index}, but {corners} come before it, counted from 1"
                        ));
                    }
                    highest = highest.max((absolute, number));
                    face.push_str(&format!(" {absolute}"));
                    count += 1;
                }
                if count > 2 {
                    out.push_str(&face);
                    out.push('\n');
                    faces += 1;
                }
            }
            "surf" | "curv" | "l" | "p" => other = other.or(Some((number, brief(&line)))),
            word @ ("usemtl" | "mtllib") if !rest.is_empty() => out.push_str(&format!("{word} {rest}\n")),
            _ => {}
        }
    }
    match highest {
        _ if faces == 0 && corners > 0 => Err(match other {
            None => format!("the file has {corners} corners and no face (lines that begin with f)"),
            Some((number, line)) => format!(
                "line {number}: \"{line}\" is a curved surface or a line, and no face (f) is in the file; export it as a mesh"
            ),
        }),
        _ if faces == 0 => {
            Err("it has no corners (lines that begin with v) and no faces (f), so it is no OBJ file".to_owned())
        }
        (index, number) if index > corners => {
            Err(format!("line {number}: the face names corner {index}, but the file has {corners}"))
        }
        _ => Ok(out),
    }
}

/// Lines with their numbers, counted from 1; one that ends in a backslash goes on with the next.
fn whole_lines(text: &str) -> impl Iterator<Item = (usize, std::borrow::Cow<'_, str>)> {
    let mut lines = (1..).zip(super::lines(text));
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut line = std::borrow::Cow::Borrowed(first.trim());
        while let Some(begun) = line.strip_suffix('\\') {
            let begun = begun.to_owned();
            let next = lines.next().map_or("", |(_, next)| next.trim());
            line = std::borrow::Cow::Owned(format!("{begun} {next}"));
        }
        Some((number, line))
    })
}

fn without_remark(text: &str) -> &str {
    text.split('#').next().unwrap_or_default()
}

/// Why a text is no number.
pub(super) fn no_number(text: &str) -> String {
    let shown = brief(text);
    if text.contains(',') && text.replacen(',', ".", 1).parse::<f32>().is_ok() {
        format!(
            "\"{shown}\" has a decimal comma; mesh files have decimal points (export it with an English number format)"
        )
    } else {
        format!("\"{shown}\" is not a number")
    }
}

/// The beginning of a text, without control characters.
pub(super) fn brief(text: &str) -> String {
    text.chars().take(40).flat_map(char::escape_debug).collect()
}
