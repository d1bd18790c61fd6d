//! URDF as it is found in the wild, made into URDF as the parser expects it.
//!
//! Kept: robot, links with inertial, visual and collision, joints with origin, parent and child, materials. Left
//! out: everything else (gazebo, transmission, sensor blocks ..). Filled in: missing names, colours, inertia terms.
//! Numbers may be separated by commas. What matters and is missing or unknown becomes a warning.

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// Nesting beyond this is not a URDF (levels); it also bounds the recursion below.
const DEEPEST: usize = 64;
/// Elements beyond this are not a graspable object.
const MOST_ELEMENTS: usize = 100_000;

/// Text that the URDF parser accepts, and what was said while making it.
#[derive(Debug)]
pub(super) struct CleanText {
    pub(super) text: String,
    pub(super) warnings: Vec<String>,
}

/// An XML element without its text.
#[derive(Debug, Default)]
struct Element {
    name: String,
    attributes: Vec<(String, String)>,
    children: Vec<Self>,
}

impl Element {
    fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    fn set(&mut self, name: &str, value: String) {
        match self.attributes.iter_mut().find(|(key, _)| key == name) {
            Some((_, old)) => *old = value,
            None => self.attributes.push((name.to_owned(), value)),
        }
    }

    fn child(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|child| child.name == name)
    }

    fn keep_children(&mut self, names: &[&str]) {
        self.children.retain(|child| names.contains(&child.name.as_str()));
    }

    /// Keeps the first child of each name: a second origin or geometry would confuse the parser.
    fn keep_first_of_each(&mut self, names: &[&str]) {
        let mut seen: Vec<String> = Vec::new();
        self.children.retain(|child| {
            let fresh = names.contains(&child.name.as_str()) && !seen.contains(&child.name);
            seen.push(child.name.clone());
            fresh
        });
    }

    fn write(&self, out: &mut String) {
        out.push('<');
        out.push_str(&self.name);
        for (key, value) in &self.attributes {
            let value = quick_xml::escape::escape(value.as_str());
            out.push_str(&format!(" {key}=\"{value}\""));
        }
        out.push('>');
        for child in &self.children {
            child.write(out);
        }
        out.push_str(&format!("</{}>", self.name));
    }
}

/// Cleans the bytes of a URDF file. The error is a sentence about what is wrong with the XML.
pub(super) fn clean(bytes: &[u8]) -> Result<CleanText, String> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}').trim_start();
    if text.contains("${") || text.contains("$(") || text.contains("<xacro:") {
        return Err("it is a xacro template, not a URDF; run `xacro FILE > object.urdf` first".to_owned());
    }
    let mut robot = parse(text)?;
    if robot.name == "sdf" {
        return Err("it is an SDF file; Palpate reads URDF, OBJ and STL".to_owned());
    }
    if robot.name != "robot" {
        return Err(format!("its outermost element is <{}>, not <robot>; it is not a URDF", robot.name));
    }
    let mut warnings = Vec::new();
    clean_robot(&mut robot, &mut warnings);
    let mut out = String::new();
    robot.write(&mut out);
    Ok(CleanText { text: out, warnings })
}

fn parse(text: &str) -> Result<Element, String> {
    let mut reader = Reader::from_str(text);
    let mut open = vec![Element::default()];
    let mut count = 0;
    loop {
        let event = reader
            .read_event()
            .map_err(|e| format!("it is not well-formed XML near byte {}: {e}", reader.error_position()))?;
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
    let outermost = open.pop().and_then(|top| top.children.into_iter().next());
    outermost.ok_or_else(|| "it holds no XML element".to_owned())
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
    Ok(Element { name, attributes, children: Vec::new() })
}

fn clean_robot(robot: &mut Element, warnings: &mut Vec<String>) {
    robot.attributes.retain(|(key, _)| key == "name");
    robot.keep_children(&["link", "joint", "material"]);
    for (k, child) in robot.children.iter_mut().enumerate() {
        if child.attribute("name").is_none() {
            child.set("name", format!("{}_{k}", child.name));
        }
        match child.name.as_str() {
            "link" => clean_link(child, warnings),
            "joint" => clean_joint(child, warnings),
            _ => clean_material(child),
        }
    }
    // A joint without both ends joins nothing.
    robot.children.retain(|child| {
        let ends = ["parent", "child"].map(|end| child.child(end).and_then(|e| e.attribute("link")).is_some());
        let sound = child.name != "joint" || ends == [true, true];
        if !sound {
            let name = child.attribute("name").unwrap_or_default();
            warnings.push(format!("joint \"{name}\" names no parent or no child and was left out"));
        }
        sound
    });
}

fn clean_link(link: &mut Element, warnings: &mut Vec<String>) {
    let name = link.attribute("name").unwrap_or_default().to_owned();
    link.attributes.retain(|(key, _)| key == "name");
    link.keep_children(&["inertial", "visual", "collision"]);
    let mut inertials = 0;
    link.children.retain(|child| {
        inertials += u32::from(child.name == "inertial");
        child.name != "inertial" || inertials == 1
    });
    for child in &mut link.children {
        if child.name == "inertial" {
            clean_inertial(child);
        } else {
            clean_shape(child, &name, warnings);
        }
    }
    link.children
        .retain(|child| child.name == "inertial" || child.child("geometry").is_some_and(|g| !g.children.is_empty()));
}

fn clean_inertial(inertial: &mut Element) {
    inertial.keep_first_of_each(&["origin", "mass", "inertia"]);
    for (part, keys) in [("mass", &["value"][..]), ("inertia", &["ixx", "ixy", "ixz", "iyy", "iyz", "izz"])] {
        if inertial.child(part).is_none() {
            inertial.children.push(Element { name: part.to_owned(), ..Element::default() });
        }
        for element in inertial.children.iter_mut().filter(|e| e.name == part) {
            for key in keys {
                if element.attribute(key).is_none_or(|v| v.trim().parse::<f64>().is_err()) {
                    element.set(key, "0".to_owned());
                }
            }
        }
    }
    clean_origin(inertial);
}

/// A visual or collision element.
fn clean_shape(shape: &mut Element, link: &str, warnings: &mut Vec<String>) {
    shape.attributes.retain(|(key, _)| key == "name");
    shape.keep_first_of_each(&["origin", "geometry", "material"]);
    if shape.name == "collision" {
        shape.keep_children(&["origin", "geometry"]);
    }
    clean_origin(shape);
    for child in &mut shape.children {
        match child.name.as_str() {
            "geometry" => clean_geometry(child, link, warnings),
            "material" => clean_material(child),
            _ => {}
        }
    }
}

fn clean_geometry(geometry: &mut Element, link: &str, warnings: &mut Vec<String>) {
    const KNOWN: [&str; 5] = ["box", "cylinder", "sphere", "capsule", "mesh"];
    if let Some(unknown) = geometry.children.iter().find(|child| !KNOWN.contains(&child.name.as_str())) {
        warnings.push(format!("link \"{link}\": the shape <{}> is not known and was left out", unknown.name));
    }
    geometry.keep_children(&KNOWN);
    geometry.children.truncate(1);
    for shape in &mut geometry.children {
        shape.children.clear();
        for key in ["size", "scale"] {
            if let Some(value) = shape.attribute(key) {
                let mut numbers = spaced(value);
                if key == "scale" && numbers.split_whitespace().count() == 1 {
                    numbers = format!("{numbers} {numbers} {numbers}");
                }
                shape.set(key, numbers);
            }
        }
    }
}

fn clean_origin(parent: &mut Element) {
    for origin in parent.children.iter_mut().filter(|child| child.name == "origin") {
        origin.attributes.retain(|(key, _)| key == "xyz" || key == "rpy");
        for (_, value) in &mut origin.attributes {
            *value = spaced(value);
        }
    }
}

fn clean_material(material: &mut Element) {
    material.attributes.retain(|(key, _)| key == "name");
    if material.attribute("name").is_none() {
        material.set("name", String::new());
    }
    material.keep_first_of_each(&["color"]);
    for colour in &mut material.children {
        let mut channels: Vec<f64> = colour
            .attribute("rgba")
            .map(|text| spaced(text).split_whitespace().filter_map(|c| c.parse().ok()).collect())
            .unwrap_or_default();
        if channels.len() < 3 {
            channels = vec![0.7, 0.7, 0.7];
        }
        channels.resize(4, 1.0);
        let text: Vec<String> = channels.iter().map(f64::to_string).collect();
        colour.attributes = vec![("rgba".to_owned(), text.join(" "))];
    }
}

fn clean_joint(joint: &mut Element, warnings: &mut Vec<String>) {
    let name = joint.attribute("name").unwrap_or_default().to_owned();
    let kind = joint.attribute("type").unwrap_or("fixed").to_owned();
    if kind != "fixed" {
        warnings.push(format!("joint \"{name}\" is {kind}; it was welded at its zero position"));
    }
    joint.attributes.retain(|(key, _)| key == "name");
    joint.set("type", "fixed".to_owned());
    joint.keep_first_of_each(&["origin", "parent", "child"]);
    clean_origin(joint);
}

/// Numbers separated by single blanks, whatever separated them before.
fn spaced(text: &str) -> String {
    let parts: Vec<&str> = text.split([',', ';', ' ', '\t', '\n', '\r']).filter(|s| !s.is_empty()).collect();
    parts.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sloppy_files_become_clean_ones() {
        let sloppy = "\u{feff}\n\n<?xml version='1.0' encoding='latin1'?>\n<!-- a mug -->\n\
            <robot xmlns:x='http://x' name='mug'><gazebo><deep><deeper/></deep></gazebo>\n\
            <link name='body' type='odd'><visual name='v'><geometry><box size='1,2,3'/></geometry>\
            <material><color rgba='1 0 0'/></material></visual>\
            <collision><geometry><heightmap/></geometry></collision>\
            <inertial><mass value='0.2'/></inertial></link>\
            <link/><joint name='j' type='revolute'><axis xyz='0 0 1'/><parent link='body'/><child link='link_1'/>\
            <limit/></joint><joint name='lost'/></robot>";
        let clean = clean(sloppy.as_bytes()).expect("mendable");
        let robot = urdf_rs::read_from_string(&clean.text).expect("the parser accepts it");
        assert_eq!((robot.links.len(), robot.joints.len()), (2, 1));
        let body = &robot.links[0];
        assert_eq!((body.visual.len(), body.collision.len()), (1, 0));
        assert!((body.inertial.mass.value - 0.2).abs() < 1e-12);
        assert_eq!(clean.warnings.len(), 3, "{:?}", clean.warnings);
    }

    #[test]
    fn what_is_not_urdf_is_said_plainly() {
        let message = |text: &str| clean(text.as_bytes()).expect_err("refused");
        assert!(message("").contains("no XML"));
        assert!(message("<sdf/>").contains("SDF"));
        assert!(message("<robot><link name='${x}'/></robot>").contains("xacro"));
        assert!(message("<robot><link></robot>").contains("well-formed"));
        assert!(message("<robot><link>").contains("cut short"));
        assert!(message(&"<robot>".repeat(10_000)).contains("nested"));
        assert!(message("<html></html>").contains("<html>"));
    }
}
