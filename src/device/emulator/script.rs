//! Bench scripts: what the emulated experimenter does, step by step, as in a calibration.
//!
//! Steps are separated by line ends or semicolons; `#` begins a remark. Words of a step are separated by spaces:
//!
//! ```text
//! angle=30 hold=2          both strips lie on a jig bent by 30 degrees, for 2 s
//! angleL=45 angleR=0       one by one
//! load=0.1kg hold=3        a weight on both pads; also loadL, loadR, and newtons: load=0.98N
//! rest=2                   hands off
//! close empty bar=0.8      the hand closes on nothing, up to 0.8 bar (1.0 without it), and opens again
//! grasp lemon              the same on an object
//! ```
//!
//! A step without `hold` takes 2 s; a grasp takes what its programme takes.

use super::event::EmulatorError;
use palpate_geometry::units::STANDARD_GRAVITY;

/// Default duration of a step (s).
const HOLD_S: f64 = 2.0;

/// One step.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Bends and loads are held, by hand.
    Hold {
        /// Bend of the strips, left and right (rad).
        bend: [f64; 2],
        /// Load on the pads, left and right (N).
        load: [f64; 2],
        /// For how long (s).
        seconds: f64,
    },
    /// The hand closes, on an object or on nothing.
    Grasp {
        /// Object: a built-in name, a file, or `empty`.
        object: String,
        /// Highest pressure (bar); the programme's own where it is not given.
        bar: Option<f64>,
    },
}

fn unknown(word: &str, instead: &str) -> String {
    format!("\"{word}\" is not known; write {instead}")
}

/// Parses a script.
pub fn parse_script(text: &str) -> Result<Vec<Step>, EmulatorError> {
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default());
    let steps = lines.flat_map(|line| line.split(';')).map(str::trim).filter(|step| !step.is_empty());
    let step = |(index, text): (usize, &str)| {
        let wrong = |problem: String| format!("step {} of the script, \"{text}\": {problem}", index + 1);
        parse_step(text).map_err(|problem| EmulatorError(wrong(problem)))
    };
    steps.enumerate().map(step).collect()
}

/// Parses one step.
fn parse_step(text: &str) -> Result<Step, String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    match words.as_slice() {
        ["close", "empty", rest @ ..] => grasp("empty", rest),
        ["grasp", object, rest @ ..] => grasp(object, rest),
        ["close" | "grasp", ..] => Err("write close empty, or grasp and an object's name".to_owned()),
        words => hold(words),
    }
}

fn grasp(object: &str, words: &[&str]) -> Result<Step, String> {
    let bar = match words {
        [] => None,
        [word] => match word.split_once('=') {
            Some(("bar", value)) => Some(within("bar", value, "", 0.05..=1.5)?),
            _ => return Err(unknown(word, "bar=0.8")),
        },
        [_, other, ..] => return Err(format!("\"{other}\" is one word too many")),
    };
    Ok(Step::Grasp { object: object.to_owned(), bar })
}

fn hold(words: &[&str]) -> Result<Step, String> {
    let (mut bend, mut load, mut seconds) = ([0.0; 2], [0.0; 2], HOLD_S);
    for word in words {
        let (name, value) = word
            .split_once('=')
            .ok_or_else(|| unknown(word, "angle=30, load=0.1kg, hold=2, rest=2, close empty or grasp lemon"))?;
        match name {
            "hold" | "rest" => seconds = within(name, value, "s", 0.0..=3600.0)?,
            "angle" | "angleL" | "angleR" => {
                set(&mut bend, name, within(name, value, "deg", 0.0..=180.0)?.to_radians());
            }
            "load" | "loadL" | "loadR" => {
                let force = match value.strip_suffix("kg") {
                    Some(kg) => within(name, kg, "", 0.0..=5.0)? * STANDARD_GRAVITY,
                    None => within(name, value, "N", 0.0..=50.0)?,
                };
                set(&mut load, name, force);
            }
            _ => {
                return Err(unknown(name, "angle, angleL, angleR, load, loadL, loadR, hold or rest"));
            }
        }
    }
    Ok(Step::Hold { bend, load, seconds })
}

/// Sets the side that a name ends in, or both.
fn set(sides: &mut [f64; 2], name: &str, value: f64) {
    match name.chars().last() {
        Some('L') => sides[0] = value,
        Some('R') => sides[1] = value,
        _ => *sides = [value; 2],
    }
}

fn within(name: &str, text: &str, unit: &str, range: std::ops::RangeInclusive<f64>) -> Result<f64, String> {
    let number = text.strip_suffix(unit).unwrap_or(text).parse().ok().filter(|value| range.contains(value));
    let (least, most) = range.into_inner();
    number.ok_or_else(|| format!("{name}={text} is not a number from {least} to {most} {unit}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bench_procedure_is_read() {
        let text = "rest=1\nangle=90 hold=2 # at the jig\nangleL=45deg; load=0.1kg hold=3\n\nloadR=2N;close empty bar=0.8\ngrasp lemon";
        let right_angle = std::f64::consts::FRAC_PI_2;
        let held = |bend, load, seconds| Step::Hold { bend, load, seconds };
        let want = [
            held([0.0; 2], [0.0; 2], 1.0),
            held([right_angle; 2], [0.0; 2], 2.0),
            held([right_angle / 2.0, 0.0], [0.0; 2], 2.0),
            held([0.0; 2], [0.1 * STANDARD_GRAVITY; 2], 3.0),
            held([0.0; 2], [0.0, 2.0], 2.0),
            Step::Grasp { object: "empty".to_owned(), bar: Some(0.8) },
            Step::Grasp { object: "lemon".to_owned(), bar: None },
        ];
        assert_eq!(parse_script(text).expect("sound"), want);
        assert_eq!(parse_script(" ;\n# nothing\n").expect("empty"), []);
    }

    #[test]
    fn what_is_wrong_with_a_step_is_said() {
        for (text, words) in [
            ("rest=1;angel=3", ["step 2", "angel", "angle"]),
            ("angle=200", ["step 1", "200", "180"]),
            ("angle=nan", ["step 1", "nan", "number"]),
            ("load=9kg", ["step 1", "9", "5"]),
            ("close", ["step 1", "close", "empty"]),
            ("grasp lemon bar=2", ["bar", "2", "1.5"]),
            ("wave", ["wave", "angle=30", "step 1"]),
        ] {
            let found = parse_script(text).expect_err(text).to_string();
            assert!(words.iter().all(|word| found.contains(word)), "{found}");
        }
    }
}
