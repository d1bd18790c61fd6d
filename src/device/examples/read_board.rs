//! Prints the readings of a board on a serial port, or of a file of captured bytes:
//! `cargo run -p palpate-device --example read_board -- /dev/ttyACM0` (none: the only likely port).

#![expect(clippy::print_stdout, reason = "an example that says what it did")]

use palpate_device::protocol::BoardEvent;
use palpate_device::serial::{LinkOptions, SerialLink};
use std::time::Duration;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args_os().nth(1).map(Into::into);
    let link = SerialLink::open(&LinkOptions { path, ..LinkOptions::default() })?;
    let mut channels = Vec::new();
    while !link.is_over() {
        for event in link.take(Duration::from_millis(200)) {
            match event {
                BoardEvent::Board(board) => channels = board.channels,
                BoardEvent::Reading(reading) => {
                    let counts = channels.iter().zip(&reading.counts);
                    let counts =
                        counts.map(|(name, count)| format!("{name} {}", count.map_or("-".into(), |c| c.to_string())));
                    println!("{:9.3} s  {}", reading.t_s, counts.collect::<Vec<_>>().join("  "));
                }
                BoardEvent::Gap(gap) => {
                    println!("nothing from {:.3} s to {:.3} s: {}", gap.from_s, gap.to_s, gap.cause);
                }
                BoardEvent::Reply(_) | BoardEvent::Captured(_) => {}
            }
        }
    }
    println!("{}", link.status().state.sentence());
    Ok(())
}
