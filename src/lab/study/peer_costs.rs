//! Tables of the manual about other engines, from `tests/peers/results/cost.json`.
//!
//! `tests/peers/mujoco_discrete.py` writes that file.

use super::stored_study::{GeneratedSection, markdown_table};
use serde::Deserialize;
use std::collections::BTreeMap;

const STORED: &str = include_str!("../../../tests/peers/results/cost.json");
/// Tolerances in the table.
const TOLERANCES: [f64; 3] = [1e-3, 1e-4, 1e-5];
/// Matched scenes, and what they are called.
const SCENES: [(&str, &str); 3] = [
    ("free_bend", "free bend"),
    ("fixed_sphere", "ball fixed, no friction"),
    ("free_sphere", "free ball, friction 0.8"),
];

#[derive(Deserialize)]
struct PeerCosts {
    mujoco: String,
    scenes: BTreeMap<String, PeerScene>,
}

#[derive(Deserialize)]
struct PeerScene {
    converged: Converged,
    #[serde(rename = "mujoco discrete")]
    mujoco: Vec<CostAt>,
    #[serde(rename = "palpate tolerance")]
    palpate: Vec<CostAt>,
}

/// Differences between runs at the finest steps.
#[derive(Deserialize)]
struct Converged {
    mujoco_scipy_deg: f64,
    palpate_scipy_deg: f64,
    hold_force_n: HoldForces,
}

#[derive(Deserialize)]
struct HoldForces {
    mujoco: f64,
    palpate: f64,
    scipy: f64,
}

/// Cost and error at one setting.
#[derive(Deserialize)]
struct CostAt {
    /// Step (s) or tolerance.
    setting: f64,
    cpu_ms: f64,
    /// RMS of joints against the engine's own converged run (degrees).
    error_own_deg: f64,
}

/// Cost at a tolerance, and MuJoCo's at the same error.
struct Matched {
    error_deg: f64,
    palpate_ms: f64,
    mujoco_ms: f64,
    /// True where MuJoCo was not measured at such an error.
    extrapolated: bool,
}

impl PeerScene {
    /// MuJoCo is of first order: error times cost is the same at all steps but for chance, and the geometric mean over
    /// them is taken.
    fn matched(&self, tolerance: f64) -> Option<Matched> {
        let ours = self.palpate.iter().find(|row| row.setting == tolerance)?;
        let error_deg = ours.error_own_deg;
        let logarithms: f64 = self.mujoco.iter().map(|row| (row.error_own_deg * row.cpu_ms).ln()).sum();
        let errors = || self.mujoco.iter().map(|row| row.error_own_deg);
        Some(Matched {
            error_deg,
            palpate_ms: ours.cpu_ms,
            mujoco_ms: (logarithms / self.mujoco.len() as f64).exp() / error_deg,
            extrapolated: error_deg < errors().fold(f64::INFINITY, f64::min)
                || error_deg > errors().fold(0.0, f64::max),
        })
    }
}

impl Matched {
    fn ratio(&self) -> f64 {
        self.mujoco_ms / self.palpate_ms
    }

    fn cell(&self) -> String {
        let Self { error_deg, palpate_ms, mujoco_ms, extrapolated } = self;
        let how = if *extrapolated { ", extrapolated" } else { "" };
        format!("{error_deg:.4}° in {palpate_ms:.1} ms; {mujoco_ms:.0} ms{how}: {:.0} x", self.ratio())
    }
}

/// Sections of the manual and the README that are written from the stored result.
pub(super) fn sections() -> Result<Vec<GeneratedSection>, serde_json::Error> {
    let costs: PeerCosts = serde_json::from_str(STORED)?;
    let scenes: Vec<&PeerScene> = SCENES.iter().filter_map(|(name, _)| costs.scenes.get(*name)).collect();
    let header =
        |first: &'static str| -> Vec<&str> { [first].into_iter().chain(SCENES.map(|(_, title)| title)).collect() };
    let row = |first: &str, cell: &dyn Fn(&PeerScene) -> String| -> Vec<String> {
        [first.to_owned()].into_iter().chain(scenes.iter().map(|scene| cell(scene))).collect()
    };
    let difference = |degrees: f64| format!("{degrees:.1e}°");
    let converged = [
        row("joints, both converged: Palpate - SciPy", &|scene| difference(scene.converged.palpate_scipy_deg)),
        row("joints: MuJoCo - SciPy", &|scene| difference(scene.converged.mujoco_scipy_deg)),
        row("hold force: Palpate / MuJoCo / SciPy", &|scene| {
            let HoldForces { mujoco, palpate, scipy } = scene.converged.hold_force_n;
            if scipy == 0.0 { "-".to_owned() } else { format!("{palpate:.4} / {mujoco:.4} / {scipy:.4} N") }
        }),
    ];
    let cell =
        |scene: &PeerScene, tolerance| scene.matched(tolerance).map_or_else(String::new, |matched| matched.cell());
    let cost = TOLERANCES.map(|tolerance| row(&format!("{tolerance:e}"), &|scene| cell(scene, tolerance)));
    let tables = format!(
        "{}\n\nWhat the same error costs: error and cost of Palpate at a tolerance; cost of MuJoCo {} at that \
         error: ratio.\n\n{}",
        markdown_table(&header(""), &converged),
        costs.mujoco,
        markdown_table(&header("tolerance"), &cost)
    );
    let ratios = || {
        let of =
            |scene: &&PeerScene| TOLERANCES.map(|tolerance| scene.matched(tolerance).map(|matched| matched.ratio()));
        scenes.iter().flat_map(of).flatten()
    };
    let in_short = format!(
        "On matched scenes Palpate is {:.0} to {:.0} times cheaper than MuJoCo at equal error.",
        ratios().fold(f64::INFINITY, f64::min),
        ratios().fold(0.0, f64::max)
    );
    Ok(vec![
        GeneratedSection { document: "assets/help/engines.md", name: "matched scenes", text: tables },
        GeneratedSection { document: "README.md", name: "engines in short", text: in_short },
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_method_of_first_order_costs_as_much_more_as_its_error_is_smaller() -> Result<(), Box<dyn std::error::Error>> {
        let at = |setting: f64, cpu_ms: f64, error_own_deg: f64| CostAt { setting, cpu_ms, error_own_deg };
        let hold_force_n = HoldForces { mujoco: 0.0, palpate: 0.0, scipy: 0.0 };
        let scene = PeerScene {
            converged: Converged { mujoco_scipy_deg: 0.0, palpate_scipy_deg: 0.0, hold_force_n },
            mujoco: vec![at(0.01, 5.0, 0.08), at(0.005, 10.0, 0.04)],
            palpate: vec![at(1e-3, 2.0, 0.05), at(1e-4, 4.0, 0.01)],
        };
        let within = scene.matched(1e-3).ok_or("no such tolerance")?;
        assert!((within.mujoco_ms - 8.0).abs() < 1e-12 && (within.ratio() - 4.0).abs() < 1e-12);
        let beyond = scene.matched(1e-4).ok_or("no such tolerance")?;
        assert!((beyond.mujoco_ms - 40.0).abs() < 1e-12 && beyond.extrapolated && !within.extrapolated);
        assert!(scene.matched(1e-5).is_none());
        Ok(())
    }
}
