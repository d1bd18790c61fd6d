//! How the columns of another program's table become trials: which one holds the time, the label, the number of the trial,
//! and which ones are channels. A mapping is given by options, or read from a profile (TOML).

use palpate_geometry::read_text;
use palpate_learn::LEAK_REST_S;
use palpate_store::FileKind;
use palpate_tactile::Signals;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Roles of the columns of a table. A column is named as in the header, with or without a unit in brackets after it, or in
/// a table without a header by its number from 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Mapping {
    /// Program that writes such tables.
    pub title: String,
    /// Columns by which such a table is known.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub known_by: Vec<String>,
    /// Lines above the header.
    pub skip: u64,
    /// Character between fields; found where none is given.
    pub delimiter: Option<char>,
    /// Column of times, as in `timestamp [ms]`; `t_s` where none is given.
    pub time: Option<String>,
    /// Column of labels, or the label of all trials.
    pub label: Option<String>,
    /// Column of labels, where there is one.
    pub label_column: Option<String>,
    /// Without a label the file's name is the label, up to this text.
    pub label_ends_at: Option<String>,
    /// Column that tells trials apart; without it the file is one trial.
    pub trial: Option<String>,
    /// A pause of this length begins a new trial, and so does a time that falls (s).
    pub split_gap_s: Option<f64>,
    /// Channels as `NAME=COLUMN [unit]` or `COLUMN [unit]`; all other columns where there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub channels: Vec<String>,
    /// Columns that are left out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub ignore: Vec<String>,
    /// Subtract each channel's mean over the first 0.15 s of its trial.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub rezero: bool,
    /// In a table with a row for each value: the columns of the channel's name and of the value.
    pub name: Option<String>,
    pub value: Option<String>,
}

/// Profiles that come with the program, by name.
pub const PROFILES: [(&str, &str); 5] = [
    ("plotjuggler", include_str!("../../assets/profiles/plotjuggler.toml")),
    ("serial-studio", include_str!("../../assets/profiles/serial-studio.toml")),
    ("edge-impulse", include_str!("../../assets/profiles/edge-impulse.toml")),
    ("teleplot", include_str!("../../assets/profiles/teleplot.toml")),
    ("lerobot", include_str!("../../assets/profiles/lerobot.toml")),
];

/// Largest profile (bytes).
const LARGEST: u64 = 1 << 20;
/// Pause that begins a new trial where no other length is given (s).
pub const SPLIT_GAP_S: f64 = 1.0;

impl Mapping {
    /// Kind of a file of a profile.
    pub const FILE: FileKind = FileKind::Other { title: "import profile", endings: &["toml"], begin: b"title = " };

    /// A profile that comes with the program, or one of a file, whose name ends in `.toml`.
    pub fn profile(name: &str) -> Result<Self, String> {
        let path = Path::new(name);
        if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
            let text =
                read_text(path, LARGEST).map_err(|cause| format!("cannot read the profile \"{name}\": {cause}"))?;
            return toml::from_str(&text).map_err(|error| format!("the profile \"{name}\" has a mistake: {error}"));
        }
        let known = PROFILES.iter().find(|(own, _)| own.eq_ignore_ascii_case(name));
        let (_, text) = known.ok_or_else(|| {
            let names: Vec<&str> = PROFILES.iter().map(|(name, _)| *name).collect();
            format!("there is no profile \"{name}\"; known are {}, or a file that ends in .toml", names.join(", "))
        })?;
        toml::from_str(text).map_err(|error| error.to_string())
    }

    /// Its text as a profile.
    pub fn to_toml(&self) -> Result<String, String> {
        toml::to_string(self).map_err(|error| error.to_string())
    }

    /// The profile by whose columns a header is known.
    pub fn known_for(header: &[&str]) -> Option<(&'static str, Self)> {
        let mut profiles = PROFILES.iter().filter_map(|(name, _)| Some((*name, Self::profile(name).ok()?)));
        profiles.find(|(_, profile)| {
            !profile.known_by.is_empty() && profile.known_by.iter().all(|wanted| header.contains(&wanted.as_str()))
        })
    }

    /// True where columns have other roles than in this program's own tables.
    pub(crate) fn has_roles(&self) -> bool {
        let Self { time, label, label_ends_at, trial, split_gap_s, channels, name, .. } = self;
        let texts = [time, label, label_ends_at, trial, name];
        texts.iter().any(|text| text.is_some()) || split_gap_s.is_some() || !channels.is_empty()
    }

    /// The channel of a column, if it is one of those listed: the name that it is given, and the column with its unit.
    pub fn channel_of(&self, column: &str) -> Option<(Option<&str>, &str)> {
        let is_it = |(_, own): &(Option<&str>, &str)| plain_name(own).eq_ignore_ascii_case(plain_name(column));
        self.channels.iter().map(|text| named_column(text)).find(is_it)
    }

    /// True where the columns are named by their numbers, as in a table without a header.
    pub(crate) fn is_by_number(&self) -> bool {
        self.time.as_ref().is_some_and(|time| plain_name(time).parse::<usize>().is_ok())
    }

    /// The label of a file whose rows have none.
    pub(crate) fn label_of(&self, path: &Path) -> String {
        if let Some(label) = &self.label {
            return label.clone();
        }
        let stem = path.file_stem().map_or_else(|| "import".to_owned(), |stem| stem.to_string_lossy().into_owned());
        let ends = self.label_ends_at.as_deref().and_then(|end| stem.find(end)).filter(|end| *end > 0);
        ends.map_or(stem.as_str(), |end| &stem[..end]).to_owned()
    }

    /// Subtracts the rest of a trial, where that is asked for.
    pub(crate) fn rezero(&self, signals: &mut Signals) {
        let Some(from) = signals.t_s.first().copied().filter(|_| self.rezero) else { return };
        let width = signals.channels.len();
        // As `evaluate --rezero`: half of what the leak check reads.
        let until = from + 0.5 * f64::from(LEAK_REST_S);
        let rest = signals.t_s.iter().take_while(|t| **t <= until).count();
        for channel in 0..width {
            let own = || signals.values.iter().skip(channel).step_by(width);
            let [count, sum] = own()
                .take(rest)
                .filter(|x| x.is_finite())
                .fold([0.0, 0.0], |[n, sum], x| [n + 1.0, sum + f64::from(*x)]);
            if count > 0.0 {
                let mean = sum / count;
                signals.values.iter_mut().skip(channel).step_by(width).for_each(|x| *x = (f64::from(*x) - mean) as f32);
            }
        }
    }

    /// Checks what no file can mend.
    pub fn check(&self) -> Result<(), String> {
        if self.name.is_some() != self.value.is_some() {
            return Err(
                "a table with a row for each value needs both the column of names and that of values".to_owned()
            );
        }
        match self.split_gap_s {
            Some(gap) if !(gap > 0.0 && gap.is_finite()) => Err(format!("a pause of {gap} s cannot split trials")),
            _ if self.delimiter.is_some_and(|delimiter| !delimiter.is_ascii()) => {
                Err("the delimiter has to be an ASCII character".to_owned())
            }
            _ => Ok(()),
        }
    }
}

/// Name of a column without the unit that may stand in brackets after it.
pub fn plain_name(column: &str) -> &str {
    column.split(['[', '(']).next().unwrap_or(column).trim()
}

/// A channel of a mapping: its name, if it is given, and its column.
pub(crate) fn named_column(text: &str) -> (Option<&str>, &str) {
    match text.split_once('=') {
        Some((name, column)) if !name.trim().is_empty() => (Some(name.trim()), column.trim()),
        _ => (None, text.trim()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_are_sound_and_survive_their_text() {
        for (name, _) in PROFILES {
            let profile = Mapping::profile(name).expect("reads");
            assert!(!profile.title.is_empty() && profile.has_roles() && profile.check().is_ok(), "{name}");
            let again: Mapping = toml::from_str(&profile.to_toml().expect("writes")).expect("reads");
            assert_eq!(again, profile);
        }
        let mut signals = Signals {
            channels: vec!["a".to_owned(), "b".to_owned()],
            t_s: vec![5.0, 5.1, 5.2],
            values: vec![10.0, f32::NAN, 12.0, f32::NAN, 31.0, 7.0],
        };
        Mapping { rezero: true, ..Mapping::default() }.rezero(&mut signals);
        let finite: Vec<f32> = signals.values.iter().copied().filter(|x| x.is_finite()).collect();
        assert_eq!(finite, [-1.0, 1.0, 20.0, 7.0]);
        let known = |header: &[&str]| Mapping::known_for(header).map(|(name, _)| name);
        assert_eq!(known(&["__time", "a"]), Some("plotjuggler"));
        assert_eq!(known(&["time", "a"]), None);
        assert!(Mapping::profile("excel").is_err_and(|text| text.contains("teleplot")));
    }

    #[test]
    fn a_label_may_be_the_beginning_of_the_name_of_the_file() {
        let profile = Mapping::profile("edge-impulse").expect("reads");
        assert_eq!(profile.label_of(Path::new("a.b/mug.3k2a.csv")), "mug");
        assert_eq!(Mapping::default().label_of(Path::new("mug.3k2a.csv")), "mug.3k2a");
        assert_eq!(named_column("force = grip [kPa]"), (Some("force"), "grip [kPa]"));
        assert_eq!(named_column("=a"), (None, "=a"));
    }
}
