//! A number the user may set or leave to Palpate.

use serde::de::{Error as _, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// `auto` or a number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Auto {
    /// Left to Palpate.
    #[default]
    Auto,
    /// Set by the user.
    Value(f64),
}

impl Auto {
    /// The user's number, if there is one.
    pub fn value(self) -> Option<f64> {
        match self {
            Self::Auto => None,
            Self::Value(x) => Some(x),
        }
    }
}

impl Serialize for Auto {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Auto => serializer.serialize_str("auto"),
            Self::Value(x) => serializer.serialize_f64(*x),
        }
    }
}

impl<'de> Deserialize<'de> for Auto {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AutoVisitor;
        impl Visitor<'_> for AutoVisitor {
            type Value = Auto;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("\"auto\" or a number")
            }
            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Auto, E> {
                if text == "auto" {
                    Ok(Auto::Auto)
                } else {
                    Err(E::custom(format!("expected \"auto\" or a number, found \"{text}\"")))
                }
            }
            fn visit_f64<E: serde::de::Error>(self, x: f64) -> Result<Auto, E> {
                Ok(Auto::Value(x))
            }
            fn visit_i64<E: serde::de::Error>(self, x: i64) -> Result<Auto, E> {
                i32::try_from(x)
                    .map(|x| Auto::Value(f64::from(x)))
                    .map_err(|e| E::custom(format!("{x} is too large: {e}")))
            }
            fn visit_u64<E: serde::de::Error>(self, x: u64) -> Result<Auto, E> {
                let signed = i64::try_from(x).map_err(E::custom)?;
                self.visit_i64(signed)
            }
        }
        deserializer.deserialize_any(AutoVisitor).map_err(D::Error::custom)
    }
}
