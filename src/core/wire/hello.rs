//! What a board says of itself: `# tactile-gripper fw=1 adc=12 vref=3.3 rate=50 ch=flexL,flexR,fsrL,fsrR rm=47000,..`.

use crate::board::Board;

/// How the hello line of our firmware begins.
const GREETING: &str = "tactile-gripper";

/// Reads a hello line, without its `#`; none where it is another remark. What it leaves out is as [`Board::default`]
/// has it, but for the channels, which then stay empty.
pub(super) fn parse(remark: &str) -> Option<Board> {
    let mut words = remark.split_whitespace();
    if words.next()? != GREETING {
        return None;
    }
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
    Some(board)
}

fn positive(text: &str) -> Option<f64> {
    text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_firmwares_hello_is_understood() {
        let text = " tactile-gripper fw=1 adc=12 vref=3.3 rate=50 ch=flexL,flexR,fsrL,fsrR rm=47000,47000,4700,4700";
        let board = Board {
            rate_hz: Some(50.0),
            divider_ohm: vec![47e3, 47e3, 4.7e3, 4.7e3],
            firmware: Some("1".to_owned()),
            ..Board::default()
        };
        assert_eq!(parse(text), Some(board));
    }

    #[test]
    fn nonsense_in_it_is_left_out() {
        let board = parse("tactile-gripper adc=99 vref=-1 rate=nan ch=a,b rm=1,2,3 colour=red");
        let plain = Board { channels: vec!["a".into(), "b".into()], ..Board::default() };
        assert_eq!(board, Some(plain));
        assert_eq!(parse("ok p=0.55"), None);
        assert_eq!(parse(""), None);
    }
}
