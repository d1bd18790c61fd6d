//! Search for an object by text. Titles, which the window shows, come before names; only an unambiguous match answers by
//! itself.

use palpate_sim::objects::object_title;

/// Objects that have a number key.
pub const NUMBERED_OBJECTS: usize = 9;
/// Most objects that are listed.
pub const LISTED_OBJECTS: usize = 2 * NUMBERED_OBJECTS;

/// Objects that fit a text, best first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ObjectSearch {
    /// Names. A text that is no object's name is the last of those with a number key, as a new name.
    pub names: Vec<String>,
    /// Place of the object that the text means; none if it fits several.
    pub sure: Option<usize>,
}

/// How a text fits an object, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fit {
    Title,
    WordOfTitle,
    PartOfTitle,
    Name,
    BeginOfName,
    PartOfName,
}

fn fit(name: &str, wanted: &str) -> Option<Fit> {
    let (title, name) = (object_title(name).to_lowercase(), name.to_lowercase());
    let words = || title.match_indices(wanted).any(|(at, _)| !title[..at].ends_with(char::is_alphanumeric));
    match () {
        () if title == wanted => Some(Fit::Title),
        () if words() => Some(Fit::WordOfTitle),
        () if title.contains(wanted) => Some(Fit::PartOfTitle),
        () if name == wanted => Some(Fit::Name),
        () if name.starts_with(wanted) => Some(Fit::BeginOfName),
        () if name.contains(wanted) => Some(Fit::PartOfName),
        () => None,
    }
}

/// Searches `known` names; without a text all fit, and the likely one is meant, which is listed in any case.
pub fn search_objects(mut known: Vec<String>, text: &str, likely: Option<&str>) -> ObjectSearch {
    let text = text.trim();
    if text.is_empty() {
        let mut sure = known.iter().position(|name| Some(name.as_str()) == likely);
        if let Some(place) = sure.take_if(|place| *place >= LISTED_OBJECTS) {
            let name = known.remove(place);
            known.insert(LISTED_OBJECTS - 1, name);
            sure = Some(LISTED_OBJECTS - 1);
        }
        return ObjectSearch { names: known, sure };
    }
    let wanted = text.to_lowercase();
    let mut found: Vec<(Fit, String)> =
        known.into_iter().filter_map(|name| fit(&name, &wanted).map(|fit| (fit, name))).collect();
    found.sort_by_key(|(fit, _)| *fit);
    let count = |wanted: Fit| found.iter().filter(|(fit, _)| *fit == wanted).count();
    // The best fits decide, where they are whole words; several alike are ambiguous.
    let sure = match found.first().map(|(fit, _)| *fit) {
        None => true,
        Some(Fit::PartOfTitle | Fit::PartOfName) => false,
        Some(best) => count(best) == 1,
    };
    let is_new = !found.iter().any(|(fit, name)| *fit == Fit::Title || name.to_lowercase() == wanted);
    let mut names: Vec<String> = found.into_iter().map(|(_, name)| name).collect();
    if is_new {
        names.insert(names.len().min(NUMBERED_OBJECTS - 1), text.to_owned());
    }
    ObjectSearch { names, sure: sure.then_some(0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sim::objects::{EMPTY, catalogue};

    fn found(text: &str) -> (Vec<String>, Option<usize>) {
        let known = catalogue().iter().map(|built_in| built_in.name.clone()).chain([EMPTY.to_owned()]).collect();
        let ObjectSearch { names, sure } = search_objects(known, text, Some("lemon"));
        (names, sure)
    }

    #[test]
    fn titles_come_before_names() {
        // Two objects are called ball on the screen; one of them has that name in files.
        assert_eq!(found("ball"), (vec!["ball".to_owned(), "bigball".to_owned()], None));
        assert_eq!(found("Tennis").1, Some(0));
        assert_eq!(found("tennis ball"), (vec!["bigball".to_owned()], Some(0)));
        // The die is called smallcube in files.
        assert_eq!(found("cube"), (vec!["cube".to_owned(), "smallcube".to_owned()], Some(0)));
        assert_eq!(found("die"), (vec!["smallcube".to_owned()], Some(0)));
        assert_eq!(found("block").1, None);
    }

    #[test]
    fn a_part_of_a_word_and_a_new_name_are_not_another_object() {
        assert_eq!(found("ring"), (vec!["syringe".to_owned(), "ring".to_owned()], None));
        assert_eq!(found("garlic"), (vec!["garlic".to_owned()], Some(0)));
        assert_eq!(found("stop").1, Some(0));
        // Without a title that fits, names count.
        assert_eq!(found("cylinder").0[found("cylinder").1.expect("sure")], "cylinder");
        let (all, likely) = found(" ");
        assert_eq!(all[likely.expect("the likely one")], "lemon");
        // One that is far down is listed last.
        let many = (0..40).map(|k| format!("part {k}")).collect();
        let ObjectSearch { names, sure } = search_objects(many, "", Some("part 30"));
        assert_eq!((names[LISTED_OBJECTS - 1].as_str(), sure), ("part 30", Some(LISTED_OBJECTS - 1)));
        assert_eq!((names[0].as_str(), names.len()), ("part 0", 40));
    }
}
