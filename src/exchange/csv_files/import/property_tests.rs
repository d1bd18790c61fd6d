//! Whatever a file holds, it is refused or it gives sound trials.

use super::*;
use proptest::num::f32::{NORMAL, QUIET_NAN, SUBNORMAL, ZERO};
use proptest::prelude::*;

/// Bytes that are likelier than others to upset a reader of this format.
const PIECES: [&[u8]; 34] = [
    b"trial",
    b"label",
    b"t_s",
    b"size",
    b"shape",
    b"p",
    b"q [Pa]",
    b"a",
    b"b",
    b"x",
    b"y",
    b"0",
    b"1",
    b"2",
    b"0.01",
    b"-7",
    b"1e9",
    b"1e-320",
    b"99999999999",
    b"-99999999999",
    b"3e38",
    b"-3e38",
    b"nan",
    b"inf",
    b"tiny",
    b"cubic",
    b"\"",
    b"\r",
    b"\0",
    b"\xFF",
    b"\xEF\xBB\xBF",
    b"\t",
    b";",
    b" ",
];

const GOOD: &str = "trial,label,t_s,size,shape,p,q [Pa]\n\
    a,x,0,tiny,cubic,1,9\na,x,1,tiny,cubic,2,8\nb,y,0,,,3,7\na,x,2,,,3,7\nb,y,1,,,,6\nb,y,1.5,,,-3,5\nb,y,3,,,0,1\n";

fn is_sound(bytes: &[u8]) -> Result<(), TestCaseError> {
    let import = match read_csv(bytes, "any", &Mapping::default(), "") {
        Ok(import) => import,
        Err(error) => {
            let text = error.to_string();
            prop_assert!(text.starts_with("cannot import \"any\"") && text.len() < 4000, "{}", text);
            prop_assert!(!text.chars().any(char::is_control), "{:?}", text);
            return Ok(());
        }
    };
    prop_assert!(!import.trials.is_empty());
    let channels = &import.trials[0].signals.channels;
    prop_assert!(!channels.is_empty() && channels.iter().all(|c| !c.is_empty()));
    for trial in &import.trials {
        let signals = &trial.signals;
        prop_assert!(!trial.name.is_empty() && !trial.label.is_empty());
        prop_assert_eq!(&signals.channels, channels);
        prop_assert!(signals.len() >= 2);
        prop_assert_eq!(signals.values.len(), signals.len() * channels.len());
        prop_assert!(signals.clone().filled().values.iter().all(|v| v.is_finite()), "gaps alone have no number");
        prop_assert!(signals.t_s.iter().all(|t| t.is_finite()));
        prop_assert!(signals.t_s.windows(2).all(|pair| pair[0] < pair[1]));
    }
    Ok(())
}

fn piece() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        6 => prop::sample::select(PIECES.as_slice()).prop_map(<[u8]>::to_vec),
        3 => Just(b",".to_vec()),
        2 => Just(b"\n".to_vec()),
        1 => any::<u8>().prop_map(|byte| vec![byte]),
    ]
}

proptest! {
    #[test]
    fn any_bytes_at_all(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        is_sound(&bytes)?;
    }

    #[test]
    fn any_rows_below_a_good_header(rows in prop::collection::vec(piece(), 0..80)) {
        let mut bytes = b"trial,label,t_s,p\n".to_vec();
        bytes.extend(rows.concat());
        is_sound(&bytes)?;
    }

    #[test]
    fn any_times_and_readings(
        rows in prop::collection::vec((0..3_u8, 0.0..1.0_f64, NORMAL | SUBNORMAL | ZERO | QUIET_NAN), 6..60),
        scale_s in prop::sample::select(vec![1e-6, 0.1, 1.0, 100.0, 1e11]),
        step_s in prop::sample::select(vec![0.0, 1e-4, 0.013, 100.0]),
    ) {
        let mut text = "trial,label,t_s,p\n".to_owned();
        let mut rows = rows;
        rows.sort_by(|a, b| a.1.total_cmp(&b.1));
        for (k, (trial, t, p)) in rows.iter().enumerate() {
            text.push_str(&format!("{trial},x{trial},{},{p}\n", t * scale_s + step_s * k as f64));
        }
        is_sound(text.as_bytes())?;
    }

    #[test]
    fn any_changes_to_a_good_file(
        changes in prop::collection::vec((0..GOOD.len(), 0..3_usize, piece()), 0..4),
        cut in 0..GOOD.len() * 3,
    ) {
        let mut bytes = GOOD.as_bytes().to_vec();
        for (place, removed, put) in changes {
            let from = place.min(bytes.len());
            let to = (from + removed).min(bytes.len());
            bytes.splice(from..to, put);
        }
        bytes.truncate(cut);
        is_sound(&bytes)?;
    }
}
