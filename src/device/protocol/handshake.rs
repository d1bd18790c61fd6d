//! Handshake of the board:
//!
//! ```text
//! # tactile-gripper fw=2 adc=12 vref=3.3 rate=50 ch=flexL,flexR,fsrL,fsrR rm=47000,47000,4700,4700 ck=55195
//! ```
//!
//! A `ck` at its end is its checksum and announces that every line of numbers has one. Our firmware has it from version 2 on,
//! so that a handshake of that version without it was cut.

use super::checksum;
use palpate_tactile::board::Board;

/// First word of the handshake.
pub(super) const GREETING: &str = "tactile-gripper";

/// First version of the firmware whose lines end in a checksum.
const CHECKED_FROM: u32 = 2;

/// Parsed handshake.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Handshake {
    pub(super) board: Board,
    /// Lines of numbers end in a checksum.
    pub(super) checked: bool,
}

/// Parses a handshake line, with its `#`; none for another remark, an error for a damaged handshake. Missing values are
/// those of [`Board::default`], but for the channels, which stay empty.
pub(super) fn parse(line: &str) -> Result<Option<Handshake>, &'static str> {
    let mut words = line.strip_prefix('#').unwrap_or(line).split_whitespace();
    if words.next() != Some(GREETING) {
        return Ok(None);
    }
    let checked = checksum::ends_in_one(line.as_bytes(), '=')?;
    let board = board(words);
    let version = board.firmware.as_ref().and_then(|version| version.parse::<u32>().ok());
    if !checked && version.is_some_and(|version| version >= CHECKED_FROM) {
        return Err("checksum missing");
    }
    Ok(Some(Handshake { board, checked }))
}

/// Parses the words behind the greeting.
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
            "emulated" => board.emulated = value == "1",
            "rate" => board.rate_hz = positive(value),
            "ch" => board.channels = value.split(',').filter(|n| !n.is_empty()).map(str::to_owned).collect(),
            "rm" => board.divider_ohm = value.split(',').map_while(positive).collect(),
            _ => {}
        }
    }
    // Resistors that do not match the channels are ignored.
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

    fn handshake(text: &str) -> Option<Board> {
        parse(text).expect("sound").map(|handshake| handshake.board)
    }

    #[test]
    fn the_firmwares_handshake_is_understood() {
        let text = "# tactile-gripper fw=1 adc=12 vref=3.3 rate=50 ch=flexL,flexR,fsrL,fsrR rm=47000,47000,4700,4700";
        let board = Board {
            rate_hz: Some(50.0),
            divider_ohm: vec![47e3, 47e3, 4.7e3, 4.7e3],
            firmware: Some("1".to_owned()),
            ..Board::default()
        };
        assert_eq!(handshake(text), Some(board.clone()));
        let emulated = Board { emulated: true, ..board };
        assert_eq!(handshake(&format!("{text} emulated=1")), Some(emulated));
    }

    #[test]
    fn nonsense_in_it_is_left_out() {
        let board = handshake("# tactile-gripper adc=99 vref=-1 rate=nan ch=a,b rm=1,2,3 colour=red");
        let plain = Board { channels: vec!["a".into(), "b".into()], ..Board::default() };
        assert_eq!(board, Some(plain));
        assert_eq!(handshake("# ok p=0.55"), None);
        assert_eq!(handshake("#"), None);
    }

    #[test]
    fn one_that_lost_a_byte_is_refused() {
        let body = "# tactile-gripper fw=2 adc=12 vref=3.3 rate=50 ch=flexL,flexR rm=47000,47000 p_max=1.00";
        let line = format!("{body} ck={}", checksum::checksum(body.as_bytes()));
        let whole = parse(&line).expect("sound").expect("a handshake");
        assert!(whole.checked && whole.board.full_scale == 4095 && whole.board.divider_ohm == [47e3; 2]);
        // Without a byte of the greeting it is another remark.
        for at in 1..line.len() {
            let mut lost = line.clone();
            lost.remove(at);
            assert!(!matches!(parse(&lost), Ok(Some(_))), "{lost}");
        }
        assert_eq!(parse(body), Err("checksum missing"));
        assert!(parse(&body.replace("fw=2", "fw=1")).expect("sound").is_some_and(|handshake| !handshake.checked));
    }
}
