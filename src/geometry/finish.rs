//! Looks of surfaces beside their colour, by the names of materials.

/// Look of a surface beside its colour: highlight, grain, sheen.
#[repr(u8)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Finish {
    /// Smooth plastic or varnish, with a sharp highlight.
    #[default]
    Plastic,
    /// No highlight, for colours that stand for data.
    Matt,
    /// Rubber, with a broad and weak highlight.
    Rubber,
    /// Brushed metal, which mirrors the light around it.
    Metal,
    /// Felt: rough, with bright fibres towards its outline.
    Felt,
    /// Peel of a citrus fruit: waxy, with pores.
    Peel,
    /// Cardboard and paper: dull, with fibres.
    Cardboard,
    /// Wood, with grain.
    Wood,
}

/// Words in names of materials, and the finish that they mean.
const FINISH_WORDS: [(&str, Finish); 18] = [
    ("steel", Finish::Metal),
    ("milled", Finish::Metal),
    ("metal", Finish::Metal),
    ("tin", Finish::Metal),
    ("bezel", Finish::Metal),
    ("aluminium", Finish::Metal),
    ("brass", Finish::Metal),
    ("chrome", Finish::Metal),
    ("felt", Finish::Felt),
    ("cloth", Finish::Felt),
    ("skin", Finish::Peel),
    ("peel", Finish::Peel),
    ("cardboard", Finish::Cardboard),
    ("paper", Finish::Cardboard),
    ("label", Finish::Cardboard),
    ("wood", Finish::Wood),
    ("rubber", Finish::Rubber),
    ("silicone", Finish::Rubber),
];

impl Finish {
    /// All of them, in the order of their numbers; as many as `Finishes` in `shaders/solid.wgsl` holds.
    pub const ALL: [Self; 8] =
        [Self::Plastic, Self::Matt, Self::Rubber, Self::Metal, Self::Felt, Self::Peel, Self::Cardboard, Self::Wood];

    /// Finish of a material in a mesh file, by a word in its name; plastic where none is known.
    pub fn of_material(name: &str) -> Self {
        let holds = |word: &str| name.split(|c: char| !c.is_alphanumeric()).any(|part| part.eq_ignore_ascii_case(word));
        FINISH_WORDS.iter().find(|(word, _)| holds(word)).map_or(Self::Plastic, |(_, finish)| *finish)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_get_their_finish_by_name() {
        for (name, finish) in [
            ("steel", Finish::Metal),
            ("Wood dark", Finish::Wood),
            ("tennis felt", Finish::Felt),
            ("tinted", Finish::Plastic),
            ("", Finish::Plastic),
        ] {
            assert_eq!(Finish::of_material(name), finish, "{name}");
        }
        assert!(Finish::ALL.iter().enumerate().all(|(k, finish)| *finish as usize == k));
    }
}
