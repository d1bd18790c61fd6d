//! Names of classes, which are the labels in files, tables and on the axes of a confusion matrix.

use palpate_geometry::is_invisible;
use palpate_sim::objects::{EMPTY, catalogue, titled};
use std::collections::BTreeMap;
use unicode_normalization::UnicodeNormalization as _;

/// Most characters of a name.
pub const LONGEST_NAME: usize = 80;

/// A text that cannot be a label, or a plan that cannot be, as a sentence.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct LabelError(pub(super) String);

/// Two objects under the name of one class.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{}\" and \"{}\" hold different objects, and the class of both is \"{class}\"; {advice}", sources[0], sources[1])]
pub struct ClassClash {
    pub class: String,
    /// Where the two objects are from.
    pub sources: [String; 2],
    /// What to do.
    pub advice: &'static str,
}

/// Form in which names of classes are compared: upper and lower case, blanks and forms of accents make no difference.
pub fn compared(name: &str) -> String {
    let words: Vec<&str> = name.split_whitespace().collect();
    words.join(" ").to_lowercase().nfc().collect()
}

/// Classes by their names, each written as it was first, or as the built-in object that has its name.
#[derive(Clone, Debug, Default)]
pub struct Classes {
    /// How each is written, by the form in which it is compared.
    written: BTreeMap<String, Vec<String>>,
    /// Where the object of each is from, with the hash of its content.
    contents: BTreeMap<String, (u64, String)>,
}

impl Classes {
    /// The class that a name stands for.
    pub fn named(&mut self, name: &str) -> &str {
        let key = compared(name);
        let built_in = || catalogue().iter().map(|b| b.name.as_str()).chain([EMPTY]).find(|own| *own == key);
        let spellings = self.written.entry(key.clone()).or_insert_with(|| vec![built_in().unwrap_or(name).to_owned()]);
        if !spellings.iter().any(|own| own == name) {
            spellings.push(name.to_owned());
        }
        &spellings[0]
    }

    /// Refuses an object of a class that has another content. `source` is a built-in name or a path.
    pub fn take(&mut self, name: &str, content: u64, source: &str, advice: &'static str) -> Result<(), ClassClash> {
        let class = self.named(name).to_owned();
        let is_built_in = |source: &str| catalogue().iter().any(|built_in| built_in.name == source);
        let (known, first) = self.contents.entry(compared(name)).or_insert_with(|| (content, source.to_owned()));
        // Versions of this program may differ in a built-in object.
        if *known == content || (is_built_in(first) && is_built_in(source)) {
            return Ok(());
        }
        Err(ClassClash { class, sources: [first.clone(), source.to_owned()], advice })
    }

    /// Spellings of the classes that are written in several ways.
    pub fn several(&self) -> Vec<String> {
        let all = self.written.values().filter(|spellings| spellings.len() > 1);
        all.map(|spellings| spellings.iter().map(|own| format!("\"{own}\"")).collect::<Vec<_>>().join(", ")).collect()
    }
}

/// Checks a label and trims the blanks around it.
pub fn class_name(text: &str) -> Result<String, LabelError> {
    let name = text.trim();
    let length = name.chars().count();
    let beginning = |characters: usize| name.chars().take(characters).collect::<String>();
    Err(LabelError(if name.is_empty() {
        "a label cannot be empty; write a name, or \"empty\" for the empty hand".to_owned()
    } else if name.contains(char::is_control) {
        format!("the label {:?} holds a control character; write it on one line without tabs", beginning(LONGEST_NAME))
    } else if name.contains(is_invisible) {
        format!("the label {:?} holds an invisible character; type it anew", beginning(LONGEST_NAME))
    } else if length > LONGEST_NAME {
        format!("the label \"{}...\" has {length} characters; {LONGEST_NAME} are allowed", beginning(20))
    } else {
        return Ok(name.to_owned());
    }))
}

/// Name of a trial's object for display: unlabelled trials have an empty name in the store.
pub fn shown_name(object: &str) -> &str {
    if object.is_empty() { "unlabelled" } else { object }
}

/// Title of a trial's object for display, with the name of its class where it differs; `unlabelled` without one.
pub fn shown_title(object: &str) -> String {
    if object.is_empty() { "unlabelled".to_owned() } else { titled(object) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings_are_one_class_and_contents_are_not() {
        let mut classes = Classes::default();
        assert_eq!(["LEMON", "Lemon ", "lemon"].map(|name| classes.named(name).to_owned()), ["lemon"; 3]);
        assert_eq!(["Caf\u{e9}", "cafe\u{301}"].map(|name| classes.named(name).to_owned()), ["Caf\u{e9}"; 2]);
        assert_eq!(["big  ball", "Big ball", "bigball"].map(compared), ["big ball", "big ball", "bigball"]);
        assert_eq!(classes.several(), ["\"Caf\u{e9}\", \"cafe\u{301}\"", "\"lemon\", \"LEMON\", \"Lemon \""]);
        let mut take = |name: &str, content, source: &str| classes.take(name, content, source, "use --class");
        assert_eq!(take("model", 1, "/can/model.urdf"), Ok(()));
        assert_eq!(take("Model", 1, "/again/model.urdf"), Ok(()));
        let clash = take("Model", 2, "/brick/model.urdf").expect_err("another content").to_string();
        assert!(clash.contains("/can/") && clash.contains("/brick/") && clash.ends_with("use --class"), "{clash}");
        assert!(take("lemon", 1, "lemon").is_ok() && take("lemon", 2, "lemon").is_ok());
        assert!(take("lemon", 2, "/mine/lemon.stl").is_err());
    }

    #[test]
    fn a_name_is_trimmed_and_nonsense_is_refused() {
        assert_eq!(class_name("  big ball\n"), Ok("big ball".to_owned()));
        assert_eq!(class_name(&"é".repeat(80)), Ok("é".repeat(80)));
        let refused = |text: &str, why: &str| class_name(text).is_err_and(|error| error.to_string().contains(why));
        assert!(refused(" \t ", "cannot be empty"));
        assert!(refused(&"x".repeat(81), "has 81 characters"));
        assert!(refused("a\tb", "control character"));
        assert!(refused("lem\u{200b}on", "invisible") && refused("lem\u{202e}on", "invisible"));
        assert_eq!((shown_name(""), shown_name("lemon")), ("unlabelled", "lemon"));
        assert_eq!(
            (shown_title(""), shown_title("bigball")),
            ("unlabelled".to_owned(), "Tennis ball (bigball)".to_owned())
        );
    }
}
