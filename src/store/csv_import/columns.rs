//! What the header says: which character separates fields, and which column is what.

use super::MOST_CHANNELS;
use super::fields::name;
use super::import_error::{ImportFault, brief};
use csv::ByteRecord;

/// Columns that every file has, each with other names people give it.
const NEEDED: [(&str, &[&str]); 3] = [
    ("trial", &["trials", "trial_id", "trial_no", "trial_number", "id", "grasp", "episode", "run", "experiment"]),
    ("label", &["labels", "class", "classes", "category", "target", "object", "object_name", "name", "y"]),
    ("t_s", &["t", "time", "time_s", "t_sec", "timestamp", "seconds", "sec", "elapsed", "t_ms", "time_ms"]),
];

/// Where everything stands in a row.
#[derive(Debug)]
pub(super) struct Columns {
    pub(super) trial: usize,
    pub(super) label: usize,
    pub(super) time: usize,
    pub(super) size: Option<usize>,
    pub(super) shape: Option<usize>,
    /// All other columns with a name: place and name.
    pub(super) channels: Vec<(usize, String)>,
    /// Number of fields in the header.
    pub(super) width: usize,
    /// Columns without a name, counted from 1.
    pub(super) nameless: Vec<usize>,
}

/// Of comma, semicolon and tab, the one that finds most of the needed columns at the beginning of a file, or else most
/// columns at all.
pub(super) fn separator(head: &[u8]) -> u8 {
    let score = |separator: u8| {
        let mut reader = csv::ReaderBuilder::new().delimiter(separator).has_headers(false).from_reader(head);
        let header = reader.byte_records().filter_map(Result::ok).find(|r| !is_blank(r)).unwrap_or_default();
        let is_needed = |field: &[u8]| NEEDED.iter().any(|(needed, _)| matches_name(field, needed));
        (header.iter().filter(|f| is_needed(f)).count(), header.len())
    };
    // The last of equals wins, and a comma is the likeliest.
    [b'\t', b';', b','].into_iter().max_by_key(|s| score(*s)).unwrap_or(b',')
}

fn matches_name(field: &[u8], wanted: &str) -> bool {
    name(field, "header").is_ok_and(|text| without_unit(text).0.eq_ignore_ascii_case(wanted))
}

/// True when a row holds nothing but separators, as the lines with which spreadsheets fill up.
pub(super) fn is_blank(record: &ByteRecord) -> bool {
    record.as_slice().iter().all(|byte| byte.is_ascii_whitespace() || b",;".contains(byte))
}

/// `pressure_left [Pa]` is the name `pressure_left` and the unit `Pa`; round brackets will do as well.
fn without_unit(text: &str) -> (&str, Option<&str>) {
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some((name, unit)) = text.strip_suffix(close).and_then(|rest| rest.rsplit_once(open))
            && !name.trim().is_empty()
        {
            return (name.trim(), Some(unit.trim()));
        }
    }
    (text, None)
}

impl Columns {
    /// Finds the columns in a header.
    pub(super) fn find(header: &ByteRecord) -> Result<Self, ImportFault> {
        let names = header.iter().map(|f| name(f, "header")).collect::<Result<Vec<_>, _>>()?;
        let named: Vec<(usize, &str, Option<&str>)> = names
            .iter()
            .enumerate()
            .map(|(place, text)| (place, without_unit(text)))
            .map(|(place, (name, unit))| (place, name, unit))
            .filter(|(_, name, _)| !name.is_empty())
            .collect();
        let place_of = |wanted: &str| -> Result<Option<usize>, ImportFault> {
            let mut places = named.iter().filter(|(_, name, _)| name.eq_ignore_ascii_case(wanted));
            match (places.next(), places.next()) {
                (_, Some(_)) => Err(ImportFault::SameColumn { column: wanted.to_owned() }),
                (first, None) => Ok(first.map(|(place, ..)| *place)),
            }
        };
        let (Some(trial), Some(label), Some(time)) = (place_of("trial")?, place_of("label")?, place_of("t_s")?) else {
            return Err(missing(&named.iter().map(|(_, name, _)| *name).collect::<Vec<_>>()));
        };
        let (size, shape) = (place_of("size")?, place_of("shape")?);
        if let Some((_, _, Some(unit))) = named.iter().find(|(place, ..)| *place == time)
            && !["s", "sec", "second", "seconds"].iter().any(|s| unit.eq_ignore_ascii_case(s))
        {
            return Err(ImportFault::TimeUnit { unit: brief(unit) });
        }
        let mut channels: Vec<(usize, String)> = Vec::new();
        for (place, name, _) in &named {
            if [Some(trial), Some(label), Some(time), size, shape].contains(&Some(*place)) {
                continue;
            }
            if channels.len() < MOST_CHANNELS && channels.iter().any(|(_, other)| other == name) {
                return Err(ImportFault::SameColumn { column: brief(name) });
            }
            channels.push((*place, (*name).to_owned()));
        }
        match channels.len() {
            0 => Err(ImportFault::NoChannels),
            count if count > MOST_CHANNELS => Err(ImportFault::TooManyChannels { count }),
            _ => {
                let nameless = (0..names.len()).filter(|i| names[*i].is_empty()).map(|i| i + 1).collect();
                Ok(Self { trial, label, time, size, shape, channels, width: names.len(), nameless })
            }
        }
    }
}

/// Which of the needed columns are missing, and which others may be meant.
fn missing(found: &[&str]) -> ImportFault {
    /// More names than this are no help in a sentence.
    const LISTED: usize = 20;
    let is_missing = |needed: &&(&str, &[&str])| !found.iter().any(|f| f.eq_ignore_ascii_case(needed.0));
    let mut advice = String::new();
    let mut names = Vec::new();
    for (needed, others) in NEEDED.iter().filter(is_missing) {
        names.push(format!("\"{needed}\""));
        if let Some(close) = closest(needed, others, found) {
            let close = brief(close);
            advice.push_str(&format!(". Is \"{close}\" meant as \"{needed}\"? Then rename it"));
        }
    }
    let mut listed: Vec<String> = found.iter().take(LISTED).map(|f| brief(f)).collect();
    if found.len() > LISTED {
        listed.push(format!("{} more", found.len() - LISTED));
    }
    ImportFault::MissingColumns { missing: names.join(" and no "), found: listed.join(", "), advice }
}

/// The column that somebody may have meant: one of the known other names, or a slip of the pen.
fn closest<'a>(needed: &str, others: &[&str], found: &[&'a str]) -> Option<&'a str> {
    let free = || found.iter().copied().filter(|f| !NEEDED.iter().any(|(n, _)| f.eq_ignore_ascii_case(n)));
    let known = others.iter().find_map(|other| free().find(|f| f.eq_ignore_ascii_case(other)));
    // Half the letters: one slip in t_s, two in the others, as two letters exchanged are.
    let slip = || free().find(|f| edits(&f.to_lowercase(), needed) <= needed.len() / 2);
    known.or_else(slip)
}

/// Number of letters to insert, remove or replace to make one word of the other.
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, other) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(letter != *other);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find(names: &[&str]) -> Result<Columns, ImportFault> {
        Columns::find(&ByteRecord::from(names.to_vec()))
    }

    fn refusal(names: &[&str]) -> String {
        find(names).expect_err("must be refused").to_string()
    }

    #[test]
    fn columns_are_found_in_any_order_and_case() {
        let found =
            find(&["", "Pressure_Left [Pa]", " T_S [s]", "LABEL", "shape", "Trial", "k (1/m)"]).expect("all there");
        assert_eq!((found.trial, found.label, found.time, found.size, found.shape), (5, 3, 2, None, Some(4)));
        assert_eq!(found.channels, [(1, "Pressure_Left".to_owned()), (6, "k".to_owned())]);
        assert_eq!((found.width, found.nameless), (7, vec![1]));
    }

    #[test]
    fn missing_columns_come_with_guesses() {
        let text = refusal(&["Trail", "class", "time", "p"]);
        assert!(text.contains("no column \"trial\" and no \"label\" and no \"t_s\""), "{text}");
        assert!(text.contains("has Trail, class, time, p"), "{text}");
        for pair in ["\"Trail\" meant as \"trial\"", "\"class\" meant as \"label\"", "\"time\" meant as \"t_s\""] {
            assert!(text.contains(pair), "{text}");
        }
        assert!(!refusal(&["trial", "label", "p"]).contains("meant"));
    }

    #[test]
    fn doubtful_headers_are_refused() {
        assert!(refusal(&["trial", "label", "t_s", "p [Pa]", "p"]).contains("two columns are called \"p\""));
        assert!(refusal(&["trial", "label", "t_s", "T_s", "p"]).contains("two columns are called \"t_s\""));
        assert!(refusal(&["trial", "label", "t_s [ms]", "p"]).contains("\"ms\"; times must be in seconds"));
        assert!(refusal(&["trial", "label", "t_s", "size"]).contains("one column per sensor channel"));
        let names: Vec<String> = (0..201).map(|i| format!("c{i}")).collect();
        let mut many = vec!["trial", "label", "t_s"];
        many.extend(names.iter().map(String::as_str));
        assert!(refusal(&many).contains("201 columns of readings"));
        assert!(find(&many[..203]).is_ok());
        assert!(refusal(&["trial", "label", "t_s", &"x".repeat(201)]).contains("201 characters"));
    }

    #[test]
    fn the_separator_is_the_one_that_finds_the_columns() {
        assert_eq!(separator(b"trial,label,t_s,p"), b',');
        assert_eq!(separator(b"\n\"trial\";label;t_s;a,b,c,d,e,f\n1,2,3,4"), b';');
        assert_eq!(separator(b"\xEF\xBB\xBFtrial\tlabel\tt_s\tp [a;b]"), b'\t');
        assert_eq!(separator(b"time;class;p"), b';');
        assert_eq!(separator(b""), b',');
    }
}
