//! Accuracy of the motion (a tolerance, by name or as a number) and method of integration.

use serde::de::{Error as _, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt::{self, Display};
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Estimated error of a step, by name or as a number.
///
/// Steps are chosen so that the estimated error of each stays below a tolerance: of joint angles and of the object's
/// turn (rad), and of fingertips and the object's position as shares of the finger's length. Errors of a whole grasp
/// are sums of these, less what springs and friction forget.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Accuracy {
    /// 1e-3, which seldom binds: hold values, quick looks, large data sets.
    Draft,
    /// 1e-4.
    Standard,
    /// 1e-6: what the others are measured against.
    Reference,
    /// A tolerance of one's own.
    Tolerance(f64),
}

impl Accuracy {
    /// The named ones, coarsest first.
    pub const NAMED: [Self; 3] = [Self::Draft, Self::Standard, Self::Reference];
    /// The tolerances there are: the largest never binds, the least is what the default Newton tolerance can serve.
    pub const TOLERANCES: RangeInclusive<f64> = 1e-9..=1e-1;

    /// The tolerance, where it has no name.
    pub fn tolerance(self) -> Option<f64> {
        match self {
            Self::Draft | Self::Standard | Self::Reference => None,
            Self::Tolerance(tolerance) => Some(tolerance),
        }
    }

    /// Estimated error that a step may have: of joint angles (rad), of fingertips and the object as shares of a finger.
    pub fn step_tolerance(self) -> f64 {
        match self {
            Self::Draft => 1e-3,
            Self::Standard => 1e-4,
            Self::Reference => 1e-6,
            Self::Tolerance(tolerance) => tolerance,
        }
    }

    /// The next level of accuracy: a tenth of the tolerance, by its name where it has one.
    #[must_use]
    pub fn finer(self) -> Self {
        // Rounded, so that a tenth of 1e-5 is 1e-6 and not its neighbour.
        let tenth = (1e14 * self.step_tolerance()).round() / 1e15;
        let named = Self::NAMED.into_iter().find(|accuracy| accuracy.step_tolerance() == tenth);
        named.unwrap_or(Self::Tolerance(tenth))
    }

    /// Ticks per second, at least: fixed steps of Euler and of rapier. A tolerance needs no more than samples and
    /// actuation do.
    pub fn least_hz(self) -> u32 {
        match self {
            Self::Draft => 150,
            Self::Standard => 300,
            Self::Reference => 9600,
            Self::Tolerance(_) => 1,
        }
    }
}

/// The name used in files and on the command line, or the tolerance.
impl Display for Accuracy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Draft => f.write_str("draft"),
            Self::Standard => f.write_str("standard"),
            Self::Reference => f.write_str("reference"),
            Self::Tolerance(tolerance) => write!(f, "{tolerance:e}"),
        }
    }
}

impl FromStr for Accuracy {
    type Err = UnknownAccuracy;

    fn from_str(text: &str) -> Result<Self, UnknownAccuracy> {
        let named = Self::NAMED.into_iter().find(|accuracy| accuracy.to_string() == text);
        let tolerance = || text.parse().ok().filter(|t| Self::TOLERANCES.contains(t)).map(Self::Tolerance);
        named.or_else(tolerance).ok_or(UnknownAccuracy)
    }
}

/// Error of a text that is neither the name of an accuracy nor a possible tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "choose draft, standard, reference, or a tolerance between {:e} and {}",
    Accuracy::TOLERANCES.start(),
    Accuracy::TOLERANCES.end()
)]
pub struct UnknownAccuracy;

impl Serialize for Accuracy {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.tolerance() {
            Some(tolerance) => serializer.serialize_f64(tolerance),
            None => serializer.collect_str(self),
        }
    }
}

impl<'de> Deserialize<'de> for Accuracy {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AccuracyVisitor;
        impl Visitor<'_> for AccuracyVisitor {
            type Value = Accuracy;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"draft\", \"standard\", \"reference\" or a tolerance")
            }
            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Accuracy, E> {
                text.parse().map_err(|cause| E::custom(format!("accuracy \"{text}\" is not known; {cause}")))
            }
            // Ranges are checked with those of all other numbers.
            fn visit_f64<E: serde::de::Error>(self, tolerance: f64) -> Result<Accuracy, E> {
                Ok(Accuracy::Tolerance(tolerance))
            }
            fn visit_i64<E: serde::de::Error>(self, whole: i64) -> Result<Accuracy, E> {
                Ok(Accuracy::Tolerance(whole as f64))
            }
        }
        deserializer.deserialize_any(AccuracyVisitor).map_err(D::Error::custom)
    }
}

/// Integrator setting of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Integrator {
    /// SDIRK2.
    Auto,
    /// Implicit Euler, one convex minimisation per step. A named accuracy stands for fixed steps of 1/150, 1/300 or
    /// 1/9600 s.
    Euler,
    /// A singly diagonally implicit Runge-Kutta method of second order, two minimisations per step.
    Sdirk2,
}

impl Integrator {
    /// Method of integration at an accuracy.
    pub fn method(self, accuracy: Accuracy) -> IntegrationMethod {
        match (self, accuracy.tolerance()) {
            (Self::Euler, _) => IntegrationMethod::Euler,
            (Self::Sdirk2 | Self::Auto, _) => IntegrationMethod::Sdirk2,
        }
    }
}

/// A method of integration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntegrationMethod {
    /// Implicit Euler.
    Euler,
    /// Two implicit stages, after Alexander (1977).
    Sdirk2,
}

impl IntegrationMethod {
    /// Order of convergence where motion is smooth.
    pub fn order(self) -> i32 {
        match self {
            Self::Euler => 1,
            Self::Sdirk2 => 2,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn names_and_tolerances_are_read_and_written() {
        for accuracy in Accuracy::NAMED.into_iter().chain([Accuracy::Tolerance(3e-5)]) {
            assert_eq!(accuracy.to_string().parse(), Ok(accuracy));
            let mut scene = Scene::default();
            scene.solver.accuracy = accuracy;
            assert_eq!(Scene::from_toml(&scene.to_toml()), Ok(scene));
        }
        for wrong in ["perfect", "0", "-1e-3", "0.2", "nan", ""] {
            let cause = wrong.parse::<Accuracy>().expect_err(wrong).to_string();
            assert!(cause.contains("draft") && cause.contains("1e-9"), "{cause}");
        }
    }

    #[test]
    fn levels_are_tenths_and_keep_their_names() {
        let levels = std::iter::successors(Some(Accuracy::Draft), |level| Some(level.finer()));
        let names: Vec<String> = levels.take(6).map(|level| level.to_string()).collect();
        assert_eq!(names, ["draft", "standard", "1e-5", "reference", "1e-7", "1e-8"]);
        assert_eq!(Accuracy::Tolerance(3.3e-5).finer(), Accuracy::Tolerance(3.3e-6));
    }

    #[test]
    fn scenes_take_both_and_refuse_the_rest() {
        let with = |setting: &str| Scene::default().with_settings(&[setting.to_owned()]);
        let accuracy = |setting: &str| with(setting).map(|scene| scene.solver.accuracy);
        assert_eq!(accuracy("solver.accuracy=draft"), Ok(Accuracy::Draft));
        assert_eq!(accuracy("solver.accuracy=1e-4"), Ok(Accuracy::Tolerance(1e-4)));
        assert!(accuracy("solver.accuracy=1").expect_err("too large").to_string().contains("solver.accuracy"));
        assert!(accuracy("solver.accuracy=best").expect_err("unknown").to_string().contains("reference"));
        assert!(with("solver.integrator=rk4").expect_err("unknown").to_string().contains("sdirk2"));
    }

    #[test]
    fn the_second_order_method_is_the_default() {
        for accuracy in Accuracy::NAMED.into_iter().chain([Accuracy::Tolerance(1e-4)]) {
            assert_eq!(Integrator::Auto.method(accuracy), IntegrationMethod::Sdirk2);
            assert_eq!(Integrator::Euler.method(accuracy), IntegrationMethod::Euler);
        }
    }
}
