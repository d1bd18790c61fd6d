//! Markdown of the manual as plain text for a terminal: headings, paragraphs, lists, code blocks, tables.

/// Kind of a part of a page.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Heading,
    Paragraph,
    Item,
    Code,
    Table,
}

/// A page wrapped to `width` characters, with bold headings where asked for. Code is not wrapped.
pub(super) fn render(markdown: &str, width: usize, bold: bool) -> String {
    let mut text = String::new();
    let mut previous = None;
    for (kind, words) in parts(markdown) {
        text.push_str(match (previous, kind) {
            (None, _) => "",
            (Some(Kind::Item), Kind::Item) => "\n",
            _ => "\n\n",
        });
        text.push_str(&match kind {
            Kind::Heading => emphasised(&inline(&words), bold),
            Kind::Paragraph => wrapped(&inline(&words), width).join("\n"),
            Kind::Item => format!("  - {}", wrapped(&inline(&words), width - 4).join("\n    ")),
            Kind::Code => {
                words.lines().map(|line| format!("    {line}").trim_end().to_owned()).collect::<Vec<_>>().join("\n")
            }
            Kind::Table => table(&words, width, bold),
        });
        previous = Some(kind);
    }
    text
}

/// A heading, and below it names with their meanings in a column of their own.
pub(super) fn definitions(title: &str, rows: &[(&str, String)], width: usize, bold: bool) -> String {
    let column = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0) + 4;
    let row = |(name, meaning): &(&str, String)| {
        let meaning = wrapped(meaning, width - column).join(&format!("\n{:column$}", ""));
        format!("{:<column$}{meaning}", format!("  {name}"))
    };
    let lines: Vec<String> = std::iter::once(emphasised(title, bold)).chain(rows.iter().map(row)).collect();
    lines.join("\n")
}

fn emphasised(text: &str, bold: bool) -> String {
    if bold { format!("\x1b[1m{text}\x1b[0m") } else { text.to_owned() }
}

/// Splits a page into its parts. Lines of a paragraph or item are joined by blanks, those of code and tables stay.
fn parts(markdown: &str) -> Vec<(Kind, String)> {
    let mut parts: Vec<(Kind, String)> = Vec::new();
    // The part that the next line may continue.
    let mut open = None;
    for line in markdown.lines() {
        let (kind, words) = match line {
            _ if line.starts_with("```") => {
                open = (open != Some(Kind::Code)).then_some(Kind::Code);
                parts.extend(open.map(|kind| (kind, String::new())));
                continue;
            }
            _ if open == Some(Kind::Code) => (Kind::Code, line),
            _ if line.trim().is_empty() || line.starts_with("<!--") => {
                open = None;
                continue;
            }
            _ if line.starts_with('#') => (Kind::Heading, line.trim_start_matches('#')),
            _ if line.starts_with('|') => (Kind::Table, line),
            _ if line.starts_with("- ") => (Kind::Item, &line[2..]),
            _ if open == Some(Kind::Item) => (Kind::Item, line.trim()),
            _ => (Kind::Paragraph, line.trim()),
        };
        let continues = open == Some(kind) && kind != Kind::Heading && !line.starts_with("- ");
        match parts.last_mut().filter(|_| continues) {
            Some((_, text)) => {
                text.push_str(match kind {
                    _ if text.is_empty() => "",
                    Kind::Code | Kind::Table => "\n",
                    _ => " ",
                });
                text.push_str(words);
            }
            None => parts.push((kind, words.to_owned())),
        }
        open = Some(kind);
    }
    parts
}

/// Text without the marks of emphasis and code; code of several words keeps its backticks.
fn inline(text: &str) -> String {
    let code = |(number, part): (usize, &str)| {
        if number % 2 == 1 && part.contains(' ') { format!("`{part}`") } else { part.to_owned() }
    };
    text.trim().replace("**", "").split('`').enumerate().map(code).collect()
}

/// Lines of at most `width` characters; longer words have lines of their own.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.is_empty() => line.push_str(word),
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// A table with aligned columns; cells of the widest columns wrap where it would not fit.
fn table(text: &str, width: usize, bold: bool) -> String {
    const GAP: usize = 2;
    /// No column is made narrower than this.
    const NARROWEST: usize = 10;
    /// Lines of a row from which on it is tall.
    const MANY: usize = 3;
    let cells = |row: &str| row.trim().trim_matches('|').split('|').map(inline).collect();
    let is_rule = |row: &Vec<String>| row.iter().all(|cell| cell.starts_with("---"));
    let rows: Vec<Vec<String>> = text.lines().map(cells).filter(|row| !is_rule(row)).collect();
    let longest = |column: usize| rows.iter().filter_map(|row| Some(row.get(column)?.chars().count())).max();
    let mut widths: Vec<usize> = (0..).map_while(longest).collect();
    while widths.iter().sum::<usize>() + GAP * widths.len().saturating_sub(1) > width {
        match widths.iter_mut().max() {
            Some(widest) if *widest > NARROWEST => *widest -= 1,
            _ => break,
        }
    }
    let wrap = |row: &Vec<String>| row.iter().zip(&widths).map(|(cell, width)| wrapped(cell, *width)).collect();
    let wrapped_rows: Vec<Vec<Vec<String>>> = rows.iter().map(wrap).collect();
    // Where first cells wrap, or others over many lines, rows need a gap between them.
    let is_tall = |parts: &Vec<Vec<String>>| parts[0].len() > 1 || parts.iter().any(|part| part.len() > MANY);
    let spread = wrapped_rows.iter().any(is_tall);
    let joined = |cells: Vec<String>| cells.join(&" ".repeat(GAP)).trim_end().to_owned();
    let mut lines = Vec::new();
    for (number, parts) in wrapped_rows.iter().enumerate() {
        if spread && number > 1 {
            lines.push(String::new());
        }
        for height in 0..parts.iter().map(Vec::len).max().unwrap_or(0) {
            let text = |part: &Vec<String>| part.get(height).cloned().unwrap_or_default();
            let line =
                joined(parts.iter().zip(&widths).map(|(part, width)| format!("{:<width$}", text(part))).collect());
            lines.push(if number == 0 { emphasised(&line, bold) } else { line });
        }
        if number == 0 {
            lines.push(joined(widths.iter().map(|width| "-".repeat(*width)).collect()));
        }
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "Summary of
`page`.

# Head

- one **bold**
  more
- two

```sh
palpate grasp
```

| a | b |
|---|---|
| long cell of several words | x |
<!-- comment -->
";

    #[test]
    fn a_page_becomes_plain_text() {
        let wanted = "Summary of page.

Head

  - one bold more
  - two

    palpate grasp

a                           b
--------------------------  -
long cell of several words  x";
        assert_eq!(render(PAGE, 80, false), wanted);
    }

    #[test]
    fn text_and_tables_wrap_to_the_width_and_headings_are_bold_where_asked() {
        let page = render(PAGE, 20, true);
        assert!(page.contains("\x1b[1mHead\x1b[0m"), "{page}");
        assert!(
            page.lines().all(|line| line.replace("\x1b[1m", "").replace("\x1b[0m", "").chars().count() <= 20),
            "{page}"
        );
    }

    #[test]
    fn definitions_hang() {
        let text = definitions("Topics", &[("one", "a b c d".to_owned()), ("three", "e".to_owned())], 14, false);
        assert_eq!(text, "Topics\n  one    a b c\n         d\n  three  e");
    }
}
