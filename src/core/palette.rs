//! Colours with a meaning: objects, sensors, themes, and the map from pressure to colour.

use serde::{Deserialize, Serialize};

/// An sRGB colour, 0-255 per channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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
}
