//! Texts of others, as they may be shown.

/// True for characters that are not seen and change what is seen: zero width, and directions of writing.
pub fn is_invisible(c: char) -> bool {
    matches!(c, '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2060}'..='\u{2069}' | '\u{feff}' | '\u{ad}')
}

/// A text of others on one line of a terminal or table: control and invisible characters are written as escapes.
pub fn one_line(text: &str) -> String {
    printable(text, false)
}

/// The same of a text that may have several lines.
pub fn printable_lines(text: &str) -> String {
    printable(text, true)
}

fn printable(text: &str, lines: bool) -> String {
    let kept = |c: char| (lines && (c == '\n' || c == '\t')) || !(c.is_control() || is_invisible(c));
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if kept(c) {
            shown.push(c);
        } else {
            shown.extend(c.escape_default());
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_seen_is_written_out() {
        assert_eq!(one_line("a\u{1b}[31m\nb\u{202e}é"), "a\\u{1b}[31m\\nb\\u{202e}é");
        assert_eq!(printable_lines("a\n\tb\u{7}"), "a\n\tb\\u{7}");
    }
}
