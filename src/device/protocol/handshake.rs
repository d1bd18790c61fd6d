//! What a board says of itself:
//!
//! ```text
//! # tactile-gripper fw=2 adc=12 vref=3.3 rate=50 ch=flexL,flexR,fsrL,fsrR rm=47000,47000,4700,4700 ck=55195
//! ```
//!
//! A `ck` at its end is the checksum of what stands before it, and says that every line of numbers has one too. From version 2
//! on our firmware has it, so that a hello of that version without one was cut on its way.

use super::checksum;
use palpate_tactile::board::Board;

/// How the hello line of our firmware begins.
const GREETING: &str = "tactile-gripper";

/// Versions of the firmware from this one on end their lines in a checksum.
const CHECKED_FROM: u32 = 2;

/// A hello.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Handshake {
    /// What it says of the board.
    pub(super) board: Board,
    /// Lines of numbers end in a checksum.
    pub(super) checked: bool,
}

/// Reads a hello line, with its `#`; none where it is another remark, an error where it was damaged. What it leaves out is
/// as [`Board::default`] has it, but for the channels, which then stay empty.
pub(super) fn parse(line: &str) -> Result<Option<Handshake>, &'static str> {
    let mut words = line.strip_prefix('#').unwrap_or(line).split_whitespace();
    if words.next() != Some(GREETING) {
        return Ok(None);
    }
    let checked = checksum::ends_in_one(line.as_bytes(), '=')?;
    let board = board(words);
    let version = board.firmware.as_ref().and_then(|version| version.parse::<u32>().ok());
    if !checked && version.is_some_and(|version| version >= CHECKED_FROM) {
        return Err("its checksum is missing");
    }
    Ok(Some(Handshake { board, checked }))
}

/// What the words behind the greeting say.
fn board<'a>(words: impl Iterator<Item = &'a str>) -> Board {
    let mut board = Board { channels: Vec::new(), ..Board::default() };
    for (key, value) in words.filter_map(|word| word.split_once('=')) {
        match key {
            "fw" => board.firmware = Some(value.chars().take(40).collect()),
            "adc" => {
                if let Some(bits) = value.parse().ok().filter(|bits: &u32| (1..=24).contains(bits)) {
                    board.full_scale = (1 << bits) - 1;
                }
            }
            "vref" => {
                if let Some(volt) = positive(value) {
                    board.reference_volt = volt;
                }
            }
            "rate" => board.rate_hz = positive(value),
            "ch" => board.channels = value.split(',').filter(|n| !n.is_empty()).map(str::to_owned).collect(),
            "rm" => board.divider_ohm = value.split(',').map_while(positive).collect(),
            _ => {}
        }
    }
    // Resistors that do not match the channels belong to nobody.
    if board.divider_ohm.len() != board.channels.len() {
        board.divider_ohm.clear();
    }
    board
}

fn positive(text: &str) -> Option<f64> {
    text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hello(text: &str) -> Option<Board> {
        parse(text).expect("sound").map(|hello| hello.board)
    }

    #[test]
    fn the_firmwares_hello_is_understood() {
        let text = "# tactile-gripper fw=1 adc=12 vref=3.3 rate=50 ch=flexL,flexR,fsrL,fsrR rm=47000,47000,4700,4700";
        let board = Board {
            rate_hz: Some(50.0),
            divider_ohm: vec![47e3, 47e3, 4.7e3, 4.7e3],
            firmware: Some("1".to_owned()),
            ..Board::default()
        };
        assert_eq!(hello(text), Some(board));
    }

    #[test]
    fn nonsense_in_it_is_left_out() {
        let board = hello("# tactile-gripper adc=99 vref=-1 rate=nan ch=a,b rm=1,2,3 colour=red");
        let plain = Board { channels: vec!["a".into(), "b".into()], ..Board::default() };
        assert_eq!(board, Some(plain));
        assert_eq!(hello("# ok p=0.55"), None);
        assert_eq!(hello("#"), None);
    }

    #[test]
    fn one_that_lost_a_byte_is_refused() {
        let body = "# tactile-gripper fw=2 adc=12 vref=3.3 rate=50 ch=flexL,flexR rm=47000,47000 p_max=1.00";
        let line = format!("{body} ck={}", checksum::checksum(body.as_bytes()));
        let whole = parse(&line).expect("sound").expect("a hello");
        assert!(whole.checked && whole.board.full_scale == 4095 && whole.board.divider_ohm == [47e3; 2]);
        // Without a byte of the greeting it is another remark.
        for at in 1..line.len() {
            let mut lost = line.clone();
            lost.remove(at);
            assert!(!matches!(parse(&lost), Ok(Some(_))), "{lost}");
        }
        assert_eq!(parse(body), Err("its checksum is missing"));
        assert!(parse(&body.replace("fw=2", "fw=1")).expect("sound").is_some_and(|hello| !hello.checked));
    }
}
