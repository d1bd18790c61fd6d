//! XML elements with their attributes and texts; tolerant of what hand-written files do to attributes.

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// Largest depth of nesting (levels): deeper is no description of an object, and recursion stays bounded.
const DEEPEST: usize = 64;
/// Largest number of elements of one file.
const MOST_ELEMENTS: usize = 100_000;

/// XML element.
#[derive(Debug, Default)]
pub(super) struct Element {
    pub(super) name: String,
    /// Its own text, without that of its children.
    pub(super) text: String,
    attributes: Vec<(String, String)>,
    pub(super) children: Vec<Self>,
}

impl Element {
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// First child of a name.
    pub(super) fn child(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|child| child.name == name)
    }
}

/// Parses the bytes of an XML file. The error names the fault.
pub(super) fn parse(text: &str) -> Result<Element, String> {
    let mut reader = Reader::from_str(text);
    let mut open = vec![Element::default()];
    let mut count = 0;
    loop {
        let event = reader.read_event().map_err(|e| {
            let at = usize::try_from(reader.error_position()).unwrap_or(0).min(text.len());
            let line = 1 + text.as_bytes()[..at].iter().filter(|byte| **byte == b'\n').count();
            format!("line {line}: it is not well-formed XML: {e}")
        })?;
        match event {
            Event::Start(start) => {
                count += 1;
                open.push(element(&start)?);
            }
            Event::Empty(start) => {
                count += 1;
                let element = element(&start)?;
                if let Some(parent) = open.last_mut() {
                    parent.children.push(element);
                }
            }
            Event::End(_) => {
                if let Some(done) = open.pop()
                    && let Some(parent) = open.last_mut()
                {
                    parent.children.push(done);
                }
            }
            Event::Text(text) => {
                if let Some(parent) = open.last_mut() {
                    parent.text.push_str(&String::from_utf8_lossy(&text));
                }
            }
            Event::Eof => break,
            _ => {}
        }
        if open.len() > DEEPEST || count > MOST_ELEMENTS {
            return Err("it is nested too deeply or has too many elements to be an object".to_owned());
        }
    }
    if open.len() > 1 {
        let unclosed = open.last().map(|element| element.name.clone()).unwrap_or_default();
        return Err(format!("it ends inside <{unclosed}>; the file is cut short"));
    }
    let mut outermost = open.pop().map(|top| top.children).unwrap_or_default().into_iter();
    let first = outermost.next().ok_or("it holds no XML element")?;
    match outermost.next() {
        Some(second) => Err(format!("a second <{}> follows the first <{}>; a file holds one", second.name, first.name)),
        None => Ok(first),
    }
}

fn element(start: &BytesStart<'_>) -> Result<Element, String> {
    let name = String::from_utf8_lossy(start.local_name().as_ref()).into_owned();
    let mut attributes = Vec::new();
    for attribute in start.html_attributes().with_checks(false) {
        let attribute = attribute.map_err(|e| format!("an attribute of <{name}> is malformed: {e}"))?;
        let raw = String::from_utf8_lossy(&attribute.value).into_owned();
        let value = quick_xml::escape::unescape(&raw).map_or_else(|_| raw.clone(), std::borrow::Cow::into_owned);
        let key = String::from_utf8_lossy(attribute.key.as_ref()).into_owned();
        if !key.contains(':') && !attributes.iter().any(|(known, _)| *known == key) {
            attributes.push((key, value));
        }
    }
    Ok(Element { name, attributes, ..Element::default() })
}
