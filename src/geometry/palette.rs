//! Colours with a meaning: the map from pressure to colour, sensors, themes. The window, pictures and plots all ask
//! here, so that a colour means the same thing everywhere.

use serde::{Deserialize, Serialize};

/// An sRGB colour, 0-255 per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rgb(pub u8, pub u8, pub u8);

impl Rgb {
    /// From channels in 0..1; values outside are clipped, NaN becomes 0.
    pub fn from_unit(channels: [f32; 3]) -> Self {
        let [r, g, b] = channels.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
        Self(r, g, b)
    }

    /// Channels in 0..1.
    pub fn to_unit(self) -> [f32; 3] {
        [self.0, self.1, self.2].map(|c| f32::from(c) / 255.0)
    }

    /// Channels in 0..1 with light added in proportion (the sRGB curve undone), for shading.
    pub fn to_linear(self) -> [f32; 3] {
        self.to_unit().map(|c| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) })
    }

    /// Relative luminance, 0 black to 1 white (WCAG 2.2).
    pub fn luminance(self) -> f32 {
        let [r, g, b] = self.to_linear();
        0.2126 * r + 0.7152 * g + 0.0722 * b
    }

    /// Contrast ratio to another colour, 1 to 21 (WCAG 2.2, 1.4.3).
    pub fn contrast(self, other: Self) -> f32 {
        let (a, b) = (self.luminance(), other.luminance());
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    /// A colour between two others: 0 is `self`, 1 is `other`.
    pub fn mix(self, other: Self, share: f32) -> Self {
        let (a, b) = (self.to_unit(), other.to_unit());
        Self::from_unit([0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * share))
    }
}

/// The map from a share of full scale to a colour: viridis (van der Walt and Smith, matplotlib, CC0), at 17 even
/// steps. Its luminance rises evenly and it reads much the same with red-green colour blindness.
pub const PRESSURE_MAP: [Rgb; 17] = [
    Rgb(68, 1, 84),
    Rgb(72, 24, 106),
    Rgb(71, 45, 123),
    Rgb(66, 64, 134),
    Rgb(59, 82, 139),
    Rgb(51, 99, 141),
    Rgb(44, 114, 142),
    Rgb(38, 130, 142),
    Rgb(33, 145, 140),
    Rgb(31, 160, 136),
    Rgb(40, 174, 128),
    Rgb(63, 188, 115),
    Rgb(94, 201, 98),
    Rgb(132, 212, 75),
    Rgb(173, 220, 48),
    Rgb(216, 226, 25),
    Rgb(253, 231, 37),
];

/// Colour of a share of full scale; clipped at both ends, NaN is the lowest.
pub fn pressure_colour(share: f32) -> Rgb {
    between(&PRESSURE_MAP, if share.is_nan() { 0.0 } else { share })
}

/// Colour at a share of a map of even steps; clipped at both ends.
fn between(map: &[Rgb], share: f32) -> Rgb {
    let at = share.clamp(0.0, 1.0) * (map.len() - 1) as f32;
    let low = (at as usize).min(map.len() - 2);
    map[low].mix(map[low + 1], at - low as f32)
}

/// The silicone of a pad.
pub const SILICONE: Rgb = Rgb(232, 222, 206);

/// Colour of a load on a pad, as a share of full scale: that of [`pressure_colour`], and the silicone's own below 1.5 %.
/// The same as in `shaders/skin.wgsl`, which adds light and shadow.
pub fn load_colour(share: f32) -> Rgb {
    let t = ((share - 0.015) / (0.06 - 0.015)).clamp(0.0, 1.0);
    let t = if t.is_nan() { 0.0 } else { t * t * (3.0 - 2.0 * t) };
    SILICONE.mix(pressure_colour(share), t)
}

/// The map from a signed share of full scale to a colour, at 17 even steps: blue, white in the middle, orange. Straight
/// lines in CIELAB from the ends of ColorBrewer's PuOr and RdBu maps, both ends equally dark.
pub const SIGNED_MAP: [Rgb; 17] = [
    Rgb(33, 102, 172),
    Rgb(73, 118, 181),
    Rgb(101, 135, 190),
    Rgb(127, 152, 199),
    Rgb(151, 170, 208),
    Rgb(175, 188, 217),
    Rgb(198, 206, 226),
    Rgb(221, 225, 235),
    Rgb(244, 244, 244),
    Rgb(239, 222, 212),
    Rgb(232, 200, 181),
    Rgb(223, 178, 150),
    Rgb(214, 157, 120),
    Rgb(203, 136, 91),
    Rgb(191, 116, 62),
    Rgb(177, 95, 31),
    Rgb(163, 75, 0),
];

/// Colour of a share between -1 and 1; clipped at both ends, NaN is the middle.
pub fn signed_colour(share: f32) -> Rgb {
    between(&SIGNED_MAP, 0.5 + 0.5 * if share.is_nan() { 0.0 } else { share })
}

/// Theme.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Theme {
    /// Light on dark.
    #[default]
    Dark,
    /// Dark on light.
    Light,
}

/// The colours of a theme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ThemeColours {
    /// Behind panels and plots.
    pub background: Rgb,
    /// Cards, headers and inactive tabs, a step away from the background.
    pub raised: Rgb,
    /// Thin lines between things.
    pub border: Rgb,
    pub text: Rgb,
    /// Text that matters less.
    pub quiet_text: Rgb,
    /// Active, selected and clickable elements.
    pub accent: Rgb,
    /// Something is as it should be.
    pub good: Rgb,
    /// Something deserves a look.
    pub warning: Rgb,
    /// Something failed.
    pub error: Rgb,
    /// The 3-D view's backdrop, above.
    pub sky: Rgb,
    /// The 3-D view's backdrop, below.
    pub horizon: Rgb,
    pub ground: Rgb,
    /// Lines of the ground's grid.
    pub grid: Rgb,
}

impl Theme {
    /// Both themes.
    pub const ALL: [Self; 2] = [Self::Dark, Self::Light];

    /// The name used in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dark => "dark",
            Self::Light => "light",
        }
    }

    /// Its colours.
    pub const fn colours(self) -> ThemeColours {
        match self {
            Self::Dark => ThemeColours {
                background: Rgb(21, 24, 28),
                raised: Rgb(31, 35, 41),
                border: Rgb(52, 58, 66),
                text: Rgb(226, 230, 235),
                quiet_text: Rgb(152, 162, 174),
                accent: Rgb(98, 168, 232),
                good: Rgb(110, 196, 124),
                warning: Rgb(240, 180, 60),
                error: Rgb(240, 104, 92),
                sky: Rgb(38, 44, 52),
                horizon: Rgb(24, 28, 33),
                ground: Rgb(44, 50, 58),
                grid: Rgb(82, 91, 102),
            },
            Self::Light => ThemeColours {
                background: Rgb(250, 250, 251),
                raised: Rgb(238, 240, 243),
                border: Rgb(204, 209, 216),
                text: Rgb(28, 32, 38),
                quiet_text: Rgb(90, 98, 108),
                accent: Rgb(20, 98, 174),
                good: Rgb(26, 116, 56),
                warning: Rgb(150, 92, 0),
                error: Rgb(186, 44, 34),
                sky: Rgb(236, 240, 244),
                horizon: Rgb(214, 220, 226),
                ground: Rgb(224, 228, 232),
                grid: Rgb(168, 176, 186),
            },
        }
    }
}

/// Quantity shown by a trace. Hue stands for the kind of sensor, shade for the place on the finger; the finger itself
/// is shown by the dash of the line, never by colour alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trace {
    /// Curvature of the whole finger or of its proximal half.
    Curvature,
    /// Curvature of the distal half.
    CurvatureDistal,
    /// Pressure or force on the whole pad or on its proximal half.
    Pressure,
    /// Pressure or force on the distal half.
    PressureDistal,
    /// Line pressure.
    Line,
}

impl Trace {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Curvature, Self::CurvatureDistal, Self::Pressure, Self::PressureDistal, Self::Line];

    /// After Okabe and Ito, shifted until each stands out by at least 3 to 1 from its theme's background.
    pub const fn colour(self, theme: Theme) -> Rgb {
        match (self, theme) {
            (Self::Curvature, Theme::Dark) => Rgb(61, 155, 214),
            (Self::CurvatureDistal, Theme::Dark) => Rgb(86, 180, 233),
            (Self::Pressure, Theme::Dark) => Rgb(230, 112, 38),
            (Self::PressureDistal, Theme::Dark) => Rgb(230, 159, 0),
            (Self::Line, Theme::Dark) => Rgb(0, 158, 115),
            (Self::Curvature, Theme::Light) => Rgb(0, 114, 178),
            (Self::CurvatureDistal, Theme::Light) => Rgb(43, 140, 196),
            (Self::Pressure, Theme::Light) => Rgb(213, 94, 0),
            (Self::PressureDistal, Theme::Light) => Rgb(168, 112, 0),
            (Self::Line, Theme::Light) => Rgb(0, 128, 93),
        }
    }
}

/// Colour of a series of a figure, by its number; from [`SERIES_COLOURS`] on they repeat.
pub const fn series_colour(number: usize, theme: Theme) -> Rgb {
    match theme {
        _ if number == NO_SERIES => theme.colours().quiet_text,
        _ if number == SHOWN_SERIES => theme.colours().text,
        Theme::Dark => SERIES_DARK[number % SERIES_COLOURS],
        Theme::Light => SERIES_LIGHT[number % SERIES_COLOURS],
    }
}

/// Number of the colour of what stands for no series of its own, such as the key of line styles.
pub const NO_SERIES: usize = usize::MAX;

/// Number of the colour of a trial that others are compared with.
pub const SHOWN_SERIES: usize = NO_SERIES - 1;

/// Number of different series colours.
pub const SERIES_COLOURS: usize = 7;

/// After Okabe and Ito: blue, vermilion, green, purple, amber, grey, sky; shifted as those of [`Trace`].
const SERIES_DARK: [Rgb; SERIES_COLOURS] = [
    Rgb(61, 155, 214),
    Rgb(230, 112, 38),
    Rgb(0, 158, 115),
    Rgb(214, 132, 178),
    Rgb(230, 159, 0),
    Rgb(152, 162, 174),
    Rgb(120, 200, 245),
];
const SERIES_LIGHT: [Rgb; SERIES_COLOURS] = [
    Rgb(0, 114, 178),
    Rgb(213, 94, 0),
    Rgb(0, 128, 93),
    Rgb(174, 82, 134),
    Rgb(168, 112, 0),
    Rgb(90, 98, 108),
    Rgb(43, 140, 196),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contrast_is_that_of_the_standard() {
        assert!((Rgb(255, 255, 255).contrast(Rgb(0, 0, 0)) - 21.0).abs() < 1e-3);
        assert!((Rgb(119, 119, 119).contrast(Rgb(255, 255, 255)) - 4.48).abs() < 0.01);
    }

    #[test]
    fn the_pressure_map_gets_brighter_all_the_way() {
        let shades: Vec<f32> = (0..=64).map(|i| pressure_colour(i as f32 / 64.0).luminance()).collect();
        assert!(shades.windows(2).all(|pair| pair[1] > pair[0] - 2e-3));
        assert_eq!(pressure_colour(-3.0), PRESSURE_MAP[0]);
        assert_eq!(pressure_colour(7.0), PRESSURE_MAP[16]);
        assert_eq!(pressure_colour(f32::NAN), PRESSURE_MAP[0]);
    }

    #[test]
    fn the_signed_map_is_neutral_in_the_middle_and_darkens_evenly_to_both_ends() {
        assert_eq!(signed_colour(0.0), Rgb(244, 244, 244));
        assert_eq!((signed_colour(-7.0), signed_colour(7.0)), (SIGNED_MAP[0], SIGNED_MAP[16]));
        assert_eq!(signed_colour(f32::NAN), SIGNED_MAP[8]);
        for sign in [-1.0, 1.0] {
            let shades: Vec<f32> = (0..=32).map(|i| signed_colour(sign * i as f32 / 32.0).luminance()).collect();
            assert!(shades.windows(2).all(|pair| pair[1] < pair[0] + 2e-3), "{sign}: {shades:?}");
        }
        assert!((SIGNED_MAP[0].luminance() - SIGNED_MAP[16].luminance()).abs() < 0.01);
    }

    #[test]
    fn a_light_load_has_the_silicone_s_colour_and_a_heavy_one_that_of_the_map() {
        assert_eq!([0.0, 0.015, f32::NAN].map(load_colour), [SILICONE; 3]);
        assert_eq!([0.06, 0.5, 2.0].map(load_colour), [0.06, 0.5, 2.0].map(pressure_colour));
    }

    #[test]
    fn text_and_traces_can_be_read_in_both_themes() {
        for theme in Theme::ALL {
            let c = theme.colours();
            for behind in [c.background, c.raised] {
                assert!(c.text.contrast(behind) >= 4.5, "{theme:?} text");
                assert!(c.quiet_text.contrast(behind) >= 4.5, "{theme:?} quiet text");
                for sign in [c.accent, c.good, c.warning, c.error] {
                    assert!(
                        sign.contrast(behind) >= 4.5,
                        "{theme:?} {sign:?} on {behind:?}: {}",
                        sign.contrast(behind)
                    );
                }
            }
            for trace in Trace::ALL {
                let contrast = trace.colour(theme).contrast(c.background);
                assert!(contrast >= 3.0, "{theme:?} {trace:?}: {contrast}");
            }
            for number in 0..SERIES_COLOURS {
                let contrast = series_colour(number, theme).contrast(c.background);
                assert!(contrast >= 3.0, "{theme:?} series {number}: {contrast}");
            }
        }
    }
}
