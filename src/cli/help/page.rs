//! Markdown of the manual as plain text for a terminal: headings, paragraphs, lists, code blocks, tables.

/// A part of a page.
#[derive(Debug, PartialEq)]
enum Block {
    Heading(String),
    Paragraph(String),
    Item(String),
    Code(Vec<String>),
    /// Rows of cells, the header first.
    Table(Vec<Vec<String>>),
}

/// A page wrapped to `width` characters, with bold headings where asked for. Code is not wrapped.
pub(super) fn render(markdown: &str, width: usize, bold: bool) -> String {
    let mut text = String::new();
    let mut previous: Option<&Block> = None;
    let blocks = blocks(markdown);
    for block in &blocks {
        match (previous, block) {
            (None, _) => {}
            (Some(Block::Item(_)), Block::Item(_)) => text.push('\n'),
            _ => text.push_str("\n\n"),
        }
        text.push_str(&match block {
            Block::Heading(title) => emphasised(&inline(title), bold),
            Block::Paragraph(words) => wrapped(&inline(words), width).join("\n"),
            Block::Item(words) => format!("  - {}", wrapped(&inline(words), width - 4).join("\n    ")),
            Block::Code(lines) => indented(lines),
            Block::Table(rows) => table(rows, width, bold),
        });
        previous = Some(block);
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

fn indented(lines: &[String]) -> String {
    lines.iter().map(|line| format!("    {line}").trim_end().to_owned()).collect::<Vec<_>>().join("\n")
}

/// Splits a page into blocks.
fn blocks(markdown: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut lines = markdown.lines().peekable();
    let mut starts_block = true;
    while let Some(line) = lines.next() {
        if line.starts_with("<!--") {
            // Marks a generated section.
        } else if line.starts_with("```") {
            blocks.push(Block::Code(lines.by_ref().take_while(|l| !l.starts_with("```")).map(str::to_owned).collect()));
        } else if line.starts_with('#') {
            blocks.push(Block::Heading(line.trim_start_matches('#').trim().to_owned()));
        } else if line.starts_with('|') {
            let mut rows = vec![cells(line)];
            while let Some(row) = lines.next_if(|l| l.starts_with('|')) {
                rows.push(cells(row));
            }
            rows.retain(|row| !row.iter().all(|cell| cell.starts_with("---")));
            blocks.push(Block::Table(rows));
        } else if let Some(item) = line.strip_prefix("- ") {
            blocks.push(Block::Item(item.to_owned()));
            starts_block = false;
            continue;
        } else if !line.trim().is_empty() {
            match blocks.last_mut() {
                Some(Block::Paragraph(text) | Block::Item(text)) if !starts_block => {
                    text.push(' ');
                    text.push_str(line.trim());
                }
                _ => blocks.push(Block::Paragraph(line.trim().to_owned())),
            }
            starts_block = false;
            continue;
        }
        starts_block = true;
    }
    blocks
}

/// Text without the marks of emphasis and code; code of several words keeps its backticks.
fn inline(text: &str) -> String {
    let code = |(number, part): (usize, &str)| {
        if number % 2 == 1 && part.contains(' ') { format!("`{part}`") } else { part.to_owned() }
    };
    text.trim().replace("**", "").split('`').enumerate().map(code).collect()
}

fn cells(row: &str) -> Vec<String> {
    row.trim().trim_matches('|').split('|').map(inline).collect()
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
fn table(rows: &[Vec<String>], width: usize, bold: bool) -> String {
    const GAP: usize = 2;
    /// No column is made narrower than this.
    const NARROWEST: usize = 10;
    /// Lines of a row from which on it is tall.
    const MANY: usize = 3;
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let cell = |row: &[String], column: usize| row.get(column).cloned().unwrap_or_default();
    let longest = |column: usize| rows.iter().map(|row| cell(row, column).chars().count()).max().unwrap_or(0);
    let mut widths: Vec<usize> = (0..columns).map(longest).collect();
    while widths.iter().sum::<usize>() + GAP * columns.saturating_sub(1) > width {
        match widths.iter_mut().max() {
            Some(widest) if *widest > NARROWEST => *widest -= 1,
            _ => break,
        }
    }
    let wrap = |row: &Vec<String>| -> Vec<Vec<String>> {
        widths.iter().enumerate().map(|(k, w)| wrapped(&cell(row, k), *w)).collect()
    };
    let wrapped_rows: Vec<Vec<Vec<String>>> = rows.iter().map(wrap).collect();
    // Where first cells wrap, or others over many lines, rows need a gap between them.
    let is_tall = |parts: &Vec<Vec<String>>| parts[0].len() > 1 || parts.iter().any(|part| part.len() > MANY);
    let spread = columns > 0 && wrapped_rows.iter().any(is_tall);
    let mut lines = Vec::new();
    for (number, parts) in wrapped_rows.into_iter().enumerate() {
        if spread && number > 1 {
            lines.push(String::new());
        }
        for height in 0..parts.iter().map(Vec::len).max().unwrap_or(0) {
            let padded = parts.iter().zip(&widths).map(|(part, width)| {
                let text = part.get(height).map_or("", String::as_str);
                format!("{text:<width$}")
            });
            let line = padded.collect::<Vec<_>>().join(&" ".repeat(GAP)).trim_end().to_owned();
            lines.push(if number == 0 { emphasised(&line, bold) } else { line });
        }
        if number == 0 {
            lines.push(widths.iter().map(|width| "-".repeat(*width)).collect::<Vec<_>>().join(&" ".repeat(GAP)));
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
