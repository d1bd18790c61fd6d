//! Bytes on a line whose two ends run at different rates: one start bit (low), eight data bits from the lowest, one stop bit
//! (high); the line rests high. A receiver waits for a falling edge and looks into the middle of each bit, by its own clock.

/// Bytes that a receiver at `read_baud` reads from bytes sent at `sent_baud` without a pause.
pub fn misread(bytes: &[u8], sent_baud: f64, read_baud: f64) -> Vec<u8> {
    if sent_baud == read_baud {
        return bytes.to_vec();
    }
    let levels: Vec<bool> = bytes
        .iter()
        .flat_map(|byte| std::iter::once(false).chain((0..8).map(move |bit| byte >> bit & 1 == 1)).chain([true]))
        .collect();
    // Time is counted in bits of the sender; behind the end the line rests.
    let bit = sent_baud / read_baud;
    let level = |t: f64| levels.get(t as usize).copied().unwrap_or(true);
    let mut read = Vec::new();
    let mut t = 0.0;
    while (t as usize) < levels.len() {
        if level(t) {
            // Edges are where sent bits begin.
            t = t.floor() + 1.0;
            continue;
        }
        let byte = (0..8).fold(0, |byte, k| byte | u8::from(level(t + (1.5 + f64::from(k)) * bit)) << k);
        read.push(byte);
        // A receiver is ready again in the middle of the stop bit.
        t += 9.5 * bit;
    }
    read
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_rates_change_nothing_and_nearly_equal_ones_neither() {
        let text = b"t_us:20000,seq:1,flexL:512.1\n";
        assert_eq!(misread(text, 115_200.0, 115_200.0), text);
        // A receiver bears a difference of some 4 % (half a bit in ten).
        assert_eq!(misread(text, 115_200.0, 117_000.0), text);
    }

    #[test]
    fn half_the_rate_makes_nonsense_that_can_be_worked_out() {
        // 'U' is 0x55: the line alternates, 0 1 0 1 0 1 0 1 0 1, low first. A receiver twice as fast sees each level twice:
        // start 0, then 0 11 00 11 0 from the lowest bit on, which is 0b0110_0110.
        assert_eq!(misread(b"U", 1.0, 2.0)[0], 0b0110_0110);
        let text: Vec<u8> = b"t_us:20000,seq:1,flexL:512.1,fsrL:30.4\n".repeat(20);
        for (sent, read) in [(115_200.0, 57_600.0), (57_600.0, 115_200.0), (250_000.0, 115_200.0)] {
            let nonsense = misread(&text, sent, read);
            let lines = nonsense.split(|byte| *byte == b'\n');
            assert!(lines.filter(|line| line.starts_with(b"t_us:")).count() == 0);
            assert!(!nonsense.is_empty());
        }
    }
}
