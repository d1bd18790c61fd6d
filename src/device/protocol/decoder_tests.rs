//! Whole streams through the decoder: every format, every fault, any bytes.

use super::*;
use palpate_tactile::board::{Board, Gap, Reading, Sensor};
use palpate_tactile::board::{Format, TimeSource};
use proptest::prelude::*;

/// What a stream says, with each chunk arriving at its time.
fn hear<'a>(chunks: impl IntoIterator<Item = (f64, &'a [u8])>) -> (Decoder, Vec<BoardEvent>) {
    let mut decoder = Decoder::default();
    let mut events = Vec::new();
    for (t, bytes) in chunks {
        decoder.push(bytes, t, &mut events);
    }
    (decoder, events)
}

/// Lines that arrive every 20 ms, the first behind the end of another.
fn hear_lines(lines: &[String]) -> (Decoder, Vec<BoardEvent>) {
    let lines: Vec<String> = lines.iter().map(|line| format!("\n{line}\n")).collect();
    hear(lines.iter().enumerate().map(|(i, line)| (0.02 * i as f64, line.as_bytes())))
}

fn readings(events: &[BoardEvent]) -> Vec<&Reading> {
    events.iter().filter_map(BoardEvent::reading).collect()
}

fn gaps(events: &[BoardEvent]) -> Vec<&Gap> {
    events.iter().filter_map(|h| if let BoardEvent::Gap(gap) = h { Some(gap) } else { None }).collect()
}

fn firmware_line(i: u32) -> String {
    let (us, a, b) = (20_000 * u64::from(i) + 123_456, 2000 + i % 7, 2100 + i % 5);
    format!("t_us:{us},seq:{i},flexL:{a}.125,flexR:{b},fsrL:12.5,fsrR:0,p_bar:0.55")
}

const HELLO: &str = "# tactile-gripper fw=1 adc=12 vref=3.3 rate=50 ch=flexL,flexR,fsrL,fsrR rm=47000,47000,4700,4700";

#[test]
fn the_firmwares_stream_is_heard_whole() {
    let mut lines = vec![HELLO.to_owned()];
    lines.extend((0..100).map(firmware_line));
    let (decoder, events) = hear_lines(&lines);
    let readings = readings(&events);
    assert_eq!((readings.len(), gaps(&events).len()), (100, 0));
    assert_eq!(readings[40].counts, [Some(2005.125), Some(2100.0), Some(12.5), Some(0.0)]);
    assert_eq!(readings[40].line_bar, Some(0.55));
    assert!(readings.windows(2).all(|pair| (pair[1].t_s - pair[0].t_s - 0.02).abs() < 1e-6));
    assert_eq!(decoder.board().divider_ohm, [47e3, 47e3, 4.7e3, 4.7e3]);
    let detected = decoder.detected().map(|d| (d.format, d.time));
    assert_eq!(detected, Some((Format::Plotter, TimeSource::Device)));
    assert_eq!(decoder.cadence().bad_lines, 0);
}

#[test]
fn the_same_stream_is_found_in_every_format() {
    type Write = fn(u32) -> String;
    let formats: [(Format, Write); 4] = [
        (Format::Plotter, |i| format!("flexL:{i} flexR:{} fsrL:nan fsrR:4", i + 1)),
        (Format::Csv, |i| format!("{i};{};;4", i + 1)),
        (Format::Csv, |i| format!("{i}\t{}\tnan\t4", i + 1)),
        (Format::JsonLines, |i| format!(r#"{{"flexL":{i},"flexR":{},"fsrL":null,"fsrR":4}}"#, i + 1)),
    ];
    for (format, write) in formats {
        let lines: Vec<String> = std::iter::once("rest of a line".to_owned()).chain((10..60).map(write)).collect();
        let (decoder, events) = hear_lines(&lines);
        assert_eq!(decoder.detected().map(|d| d.format), Some(format));
        let readings = readings(&events);
        assert_eq!(readings.len(), 50, "{format:?}");
        assert_eq!(decoder.board().channels, Board::default().channels, "{format:?}");
        for (reading, i) in readings.iter().zip(10u8..) {
            let i = f32::from(i);
            assert_eq!(reading.counts, [Some(i), Some(i + 1.0), None, Some(4.0)], "{format:?}");
        }
    }
}

#[test]
fn a_header_that_comes_late_renames_the_columns() {
    let mut lines: Vec<String> = (0..30).map(|i| format!("{},{i},7,8,9", 20 * i)).collect();
    lines[10] = "ms,flexR,flexL,fsrL,fsrR".to_owned();
    let (decoder, events) = hear_lines(&lines);
    let board = decoder.board();
    assert_eq!(board.channels, ["column 1", "flexR", "flexL", "fsrL", "fsrR"]);
    assert_eq!(readings(&events).last().map(|r| r.counts.clone()), {
        Some(vec![None, Some(29.0), Some(7.0), Some(8.0), Some(9.0)])
    });
    assert_eq!(decoder.detected().map(|d| d.time), Some(TimeSource::Device));
    assert_eq!(board.channel_of(Sensor::FLEX_RIGHT), Some(1));
}

#[test]
fn lost_lines_and_bad_lines_are_gaps_and_nothing_is_invented() {
    let mut lines: Vec<String> = (0..300).map(firmware_line).collect();
    lines[50] = lines[50][..40].to_owned();
    lines[80] = "\u{fffd}garbage~~".to_owned();
    lines[120] = format!("{}{}", &lines[120][..60], lines[121]);
    lines.drain(200..204);
    lines.remove(121);
    let (decoder, events) = hear_lines(&lines);
    let gaps = gaps(&events);
    assert_eq!(gaps.iter().map(|gap| gap.lost).collect::<Vec<_>>(), [Some(1), Some(1), Some(2), Some(4)]);
    assert_eq!((gaps[1].cause.as_str(), gaps[3].cause.as_str()), ("1 unreadable line", "lost in transit"));
    for reading in readings(&events) {
        let i = reading.seq.unwrap_or_default();
        let wanted = [Some((2000 + i % 7) as f32 + 0.125), Some((2100 + i % 5) as f32), Some(12.5), Some(0.0)];
        assert_eq!(reading.counts, wanted, "{i}");
    }
    let cadence = decoder.cadence();
    assert_eq!((cadence.samples, cadence.lost, cadence.bad_lines), (292, 8, 3));
}

/// A line with its checksum.
fn signed(line: &str, mark: &str) -> String {
    format!("{line}{mark}{}", checksum::checksum(line.as_bytes()))
}

#[test]
fn a_digit_that_is_lost_is_a_bad_line_where_lines_have_checksums() {
    let sound: Vec<String> = (0..600).map(|i| signed(&firmware_line(i), ",ck:")).collect();
    let hello = signed(&HELLO.replace("fw=1", "fw=2"), " ck=");
    for first in [hello, "# heard too late for the hello".to_owned()] {
        let mut lines = sound.clone();
        // Every byte of a line in turn, each from a line of its own; the last of them is cut before its checksum.
        let damaged: Vec<usize> = (100..600).step_by(5).collect();
        for (at, line) in damaged.iter().enumerate() {
            let end = lines[*line].find(",ck").unwrap_or_default();
            let lost = at % (lines[*line].len() - 1);
            lines[*line].remove(lost);
            if at + 1 == damaged.len() {
                lines[*line] = sound[*line][..end].to_owned();
            }
        }
        let (decoder, events) = hear_lines(&std::iter::once(first).chain(lines).collect::<Vec<_>>());
        let cadence = decoder.cadence();
        assert_eq!((cadence.samples, cadence.lost, cadence.bad_lines), (500, 100, 100));
        for reading in readings(&events) {
            let i = reading.seq.unwrap_or_default();
            let wanted = [Some((2000 + i % 7) as f32 + 0.125), Some((2100 + i % 5) as f32), Some(12.5), Some(0.0)];
            assert_eq!((&reading.counts[..], i % 5 == 0 && i >= 100), (&wanted[..], false), "{i}");
        }
        assert_eq!(decoder.board().channels, ["flexL", "flexR", "fsrL", "fsrR"], "the checksum is none");
    }
}

#[test]
fn a_board_that_comes_back_with_another_sketch_needs_no_checksums() {
    let mut decoder = Decoder::default();
    let mut events = Vec::new();
    let hello = signed("# tactile-gripper fw=2 adc=12 ch=flexL", " ck=");
    decoder.push(format!("{hello}\nflexL:1\nflexL:2\n").as_bytes(), 0.0, &mut events);
    assert_eq!((readings(&events).len(), decoder.cadence().bad_lines), (0, 2), "they lack what was said of them");
    decoder.interrupt("unplugged");
    decoder.push(b"\nflexL:1\nflexL:2\n", 1.0, &mut events);
    assert_eq!(readings(&events).len(), 2);
}

#[test]
fn a_board_that_restarts_or_comes_back_leaves_a_gap_with_its_cause() {
    let mut decoder = Decoder::default();
    let mut events = Vec::new();
    let mut t = 0.0;
    decoder.push(b"\n", t, &mut events);
    for i in 0..150u32 {
        if i == 100 {
            t += 3.0;
            decoder.interrupt("the cable was pulled");
            decoder.push(b"45,fsrR:0\n", t, &mut events);
        }
        let restarted = i % 100;
        decoder.push(format!("{}\n", firmware_line(restarted)).as_bytes(), t, &mut events);
        t += 0.02;
    }
    let gaps = gaps(&events);
    assert_eq!(gaps.len(), 1);
    assert!(gaps[0].cause.starts_with("the cable was pulled") && gaps[0].to_s - gaps[0].from_s > 2.9, "{gaps:?}");
    assert_eq!(readings(&events).len(), 150);
}

#[test]
fn ten_bits_are_suspected_from_strips_and_wider_counts_from_any_sensor() {
    let range = |handshake: &str, strip: u32, pad: u32| {
        let sample =
            |i: u32| format!("t_us:{},flexL:{},flexR:{strip},fsrL:{pad},fsrR:0,heap:70000", 20_000 * i, strip + i % 3);
        let lines: Vec<String> = std::iter::once(handshake.to_owned()).chain((0..300).map(sample)).collect();
        let (decoder, _) = hear_lines(&lines);
        (decoder.adc_range(), decoder.saturation()[0])
    };
    use AdcRange::{Exceeded, Fits, LooksTenBit};
    assert_eq!(range("# no handshake", 350, 0), (LooksTenBit, None));
    assert_eq!(range(HELLO, 350, 0), (LooksTenBit, None), "a strip is above a quarter of the range");
    assert_eq!(range(HELLO, 1021, 0), (LooksTenBit, Some(Saturation::High)), "and this one is open");
    assert_eq!(range(HELLO, 1400, 900), (Fits, None));
    assert_eq!(range(&HELLO.replace("47000", "100000"), 800, 0), (Fits, None), "beside 100 kΩ it may be lower");
    assert_eq!(range(HELLO, 0, 900), (Fits, Some(Saturation::Low)), "a pad may be anywhere");
    assert_eq!(range(&HELLO.replace("adc=12", "adc=10"), 350, 0), (Fits, None), "as stated");
    assert_eq!(range(HELLO, 5700, 0), (Exceeded, None));
    assert_eq!(range(&HELLO.replace("adc=12", "adc=16"), 22_700, 0), (Fits, None));
}

/// A line without a checksum, as other people's sketches write them.
fn plain_line(i: u32) -> String {
    format!("flexL:{},flexR:{},fsrL:{}", 2000 + i % 7, 2100 + i % 5, 12 + i % 3)
}

#[test]
fn of_a_line_that_lost_its_beginning_nothing_is_taken() {
    let whole = plain_line(50);
    for from in 1..whole.len() {
        let mut lines: Vec<String> = (0..100).map(plain_line).collect();
        lines[50] = whole[from..].to_owned();
        let (decoder, events) = hear_lines(&lines);
        assert_eq!((readings(&events).len(), decoder.cadence().bad_lines), (99, 1), "{}", &whole[from..]);
        assert_eq!(decoder.board().channels, ["flexL", "flexR", "fsrL"], "{}", &whole[from..]);
    }
    for damaged in ["flexL:2003m,flexR:2100,fsrL:14", "flexL:2003,flexR:210o,fsrL:14"] {
        let mut lines: Vec<String> = (0..100).map(plain_line).collect();
        lines[50] = damaged.to_owned();
        let (decoder, events) = hear_lines(&lines);
        assert_eq!((readings(&events).len(), decoder.cadence().bad_lines), (99, 1), "{damaged}");
    }
}

#[test]
fn a_word_in_place_of_a_number_costs_that_channel_alone() {
    // The middle one is missing in every third line, the last in every fifth.
    let word = |i: u32, every: u32, word: &str, number: u32| {
        if i.is_multiple_of(every) { word.to_owned() } else { number.to_string() }
    };
    let named = |i| format!("flexL:{i},flexR:{},fsrL: {}", word(i, 3, "open", 7), word(i, 5, "n/a", 8));
    let columns = |i| format!("{i},{},{}", word(i, 3, "err", 7), word(i, 5, "OFF", 8));
    for lines in [(1..90).map(named).collect::<Vec<_>>(), (1..90).map(columns).collect()] {
        let (decoder, events) = hear_lines(&lines);
        let readings = readings(&events);
        assert_eq!((readings.len(), decoder.cadence().bad_lines), (89, 0), "{}", lines[2]);
        for (i, reading) in (1u8..).zip(readings) {
            let wanted = [Some(f32::from(i)), (i % 3 != 0).then_some(7.0), (i % 5 != 0).then_some(8.0)];
            assert_eq!(reading.counts, wanted, "{}", lines[usize::from(i) - 1]);
        }
    }
}

#[test]
fn a_number_without_a_name_belongs_to_every_line_or_was_torn_off() {
    // A sketch that prints its scale behind its values, for Arduino's plotter.
    let always = |i: u32| format!("flexL:{},flexR:7,0,1023", 500 + i);
    let (decoder, events) = hear_lines(&(0..60).map(always).collect::<Vec<_>>());
    assert_eq!((decoder.board().channels.join(" ").as_str(), readings(&events).len() > 55), ("flexL flexR", true));
    // One bit, and a digit is a blank.
    for torn in ["flexL:2 03,flexR:2100,fsrL:14", "flexL:2003,flexR:2 00,fsrL:14", "flexL:2003,flexR:21,0,fsrL:14"] {
        let mut lines: Vec<String> = (0..100).map(plain_line).collect();
        lines[50] = torn.to_owned();
        let (decoder, events) = hear_lines(&lines);
        assert_eq!((readings(&events).len(), decoder.cadence().bad_lines), (99, 1), "{torn}");
    }
}

#[test]
fn another_sketch_after_an_interruption_is_another_board() {
    let mut decoder = Decoder::default();
    let (mut events, mut t) = (Vec::new(), 0.0);
    let mut say = |decoder: &mut Decoder, lines: &mut dyn Iterator<Item = String>| {
        for line in lines {
            t += 0.02;
            decoder.push(format!("\n{line}\n").as_bytes(), t, &mut events);
        }
        events.iter().rev().find_map(|h| if let BoardEvent::Board(board) = h { Some(board.clone()) } else { None })
    };
    let found = say(
        &mut decoder,
        &mut std::iter::once("flexL,fsrL".to_owned()).chain((0..300).map(|i| format!("{},3", 350 + i % 5))),
    );
    assert_eq!((found.map(|board| board.full_scale), decoder.adc_range()), (Some(4095), AdcRange::LooksTenBit));
    decoder.interrupt("unplugged");
    // The same names stay until others come; the counts are judged anew.
    let found = say(&mut decoder, &mut (0..20).map(|i| format!("{},3", 1400 + i)));
    assert_eq!(found.map(|board| board.channels), Some(vec!["flexL".into(), "fsrL".into()]));
    assert_eq!(decoder.adc_range(), AdcRange::Fits);
    decoder.interrupt("unplugged");
    let found =
        say(&mut decoder, &mut std::iter::once("time,angle".to_owned()).chain((0..20).map(|i| format!("{i},3"))));
    assert_eq!(found.map(|board| board.channels), Some(vec!["time".into(), "angle".into()]));
}

#[test]
fn what_a_board_says_while_it_sets_itself_up_is_no_reading() {
    let chatter = [
        "Sensor: 1 ok",
        "Sensor: 2 ok",
        "Gain, 2, high",
        "Rate, 50, low",
        "Calibrating, please wait",
        "Calibrating, please wait",
    ];
    let lines: Vec<String> = chatter.iter().map(|line| (*line).to_owned()).chain((0..40).map(plain_line)).collect();
    let (decoder, events) = hear_lines(&lines);
    assert_eq!((readings(&events).len(), decoder.board().channels.len()), (40, 3), "{:?}", decoder.board().channels);
    // Names that have been said are not put out of use by words.
    let mut lines = vec!["flexL,flexR".to_owned()];
    lines.extend(
        (0..40).map(|i| if i == 20 { "Calibrating,please".to_owned() } else { format!("{},{}", 500 + i, 600 + i) }),
    );
    let (decoder, events) = hear_lines(&lines);
    assert_eq!((readings(&events).len(), decoder.cadence().bad_lines), (39, 1));
    assert_eq!(decoder.board().channels, ["flexL", "flexR"]);
}

#[test]
fn resistors_are_found_by_the_sensor_whatever_its_channel_is_called() {
    let lines = [
        "# tactile-gripper fw=1 ch=flexL,fsrL rm=33000,3300",
        "flex_L:1,FSR L:2",
        "flex_L:1,fsr-l:2",
        "flex_L:1,fsr-l:2",
    ];
    let (decoder, _) = hear_lines(&lines.map(str::to_owned));
    assert_eq!(
        (decoder.board().channels, decoder.board().divider_ohm),
        (vec!["flex_L".into(), "fsr-l".into()], vec![33e3, 3.3e3])
    );
}

#[test]
fn another_sketch_is_believed_after_two_of_its_lines() {
    let lines: Vec<String> =
        (0..20).map(|i| if i < 10 { format!("{i},1,2,3") } else { format!("grip:{i} bend:2") }).collect();
    let (decoder, events) = hear_lines(&lines);
    assert_eq!(readings(&events).len(), 20);
    assert_eq!(decoder.board().channels, ["flexL", "flexR", "fsrL", "fsrR", "grip", "bend"]);
    assert_eq!(decoder.cadence().bad_lines, 0);
}

/// Bytes like a line's, a fault in them, or none at all.
fn bytes() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        3 => (0u32..500).prop_map(|i| format!("{}\n", firmware_line(i)).into_bytes()),
        1 => prop::collection::vec(any::<u8>(), 0..60),
        1 => (0u32..500, 0usize..90).prop_map(|(i, cut)| {
            let line = firmware_line(i);
            line.as_bytes()[..cut.min(line.len())].to_vec()
        }),
        1 => "[0-9,;: \t\r\n{}>#\"a-z.-]{0,80}".prop_map(String::into_bytes),
    ]
}

#[test]
fn nonsense_at_a_wrong_speed_is_not_held_against_the_lines() {
    let (mut decoder, mut events) = (Decoder::default(), Vec::new());
    decoder.push(b"\xff\xfe\n\x81\x90\n\xa0\n", 0.1, &mut events);
    assert!(decoder.cadence().bad_lines > 0);
    decoder.interrupt("the speed was found to be 250000 baud");
    for k in 0..5 {
        decoder.push(format!("flexL:{k},flexR:2\n").as_bytes(), 0.2 + 0.02 * f64::from(k), &mut events);
    }
    assert_eq!((decoder.cadence().bad_lines, decoder.cadence().samples > 2), (0, true));
    // Once something was read, what cannot be read counts.
    decoder.push(b"\xff\n", 0.4, &mut events);
    decoder.interrupt("the cable was pulled");
    assert_eq!(decoder.cadence().bad_lines, 1);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn whatever_comes_time_moves_on_and_counts_add_up(chunks in prop::collection::vec((bytes(), 0.0f64..0.5), 0..150)) {
        let mut decoder = Decoder::default();
        let (mut events, mut t) = (Vec::new(), 0.0);
        for (chunk, wait) in &chunks {
            t += wait;
            decoder.push(chunk, t, &mut events);
        }
        let (mut last, mut channels) = (f64::NEG_INFINITY, 0);
        for event in &events {
            match event {
                BoardEvent::Reading(reading) => {
                    prop_assert!(reading.t_s > last && reading.t_s <= reading.arrived_s + 1e-3, "{reading:?}");
                    prop_assert_eq!(reading.counts.len(), channels);
                    prop_assert!(reading.counts.iter().flatten().all(|count| count.is_finite()));
                    last = reading.t_s;
                }
                BoardEvent::Gap(gap) => prop_assert!(gap.from_s == last && gap.to_s > gap.from_s, "{gap:?}"),
                BoardEvent::Board(board) => {
                    prop_assert!(board.channels.len() >= channels && board.channels.len() <= 64);
                    channels = board.channels.len();
                }
                BoardEvent::Reply(_) | BoardEvent::Captured(_) => {}
            }
        }
        prop_assert_eq!(decoder.cadence().samples as usize, readings(&events).len());
    }

    #[test]
    fn how_a_stream_is_cut_does_not_matter(chunks in prop::collection::vec(bytes(), 0..60), cut in 1usize..97) {
        let whole: Vec<u8> = chunks.concat();
        let (_, at_once) = hear([(1.0, whole.as_slice())]);
        let (_, in_pieces) = hear(whole.chunks(cut).map(|chunk| (1.0, chunk)));
        prop_assert_eq!(at_once, in_pieces);
    }
}

#[test]
fn names_that_are_the_first_line_are_read_where_they_are_whole() {
    let after = |first: &str| {
        let text: String = (0..20).map(|i| format!("{},{i},21{i:02},20{i:02},5,6\n", 20_000 * i)).collect();
        let (decoder, events) = hear([(0.0, first.as_bytes()), (0.5, text.as_bytes())]);
        (decoder.board().channels, readings(&events).len())
    };
    let (channels, read) = after("t_us,seq,flexR,flexL,fsrL,fsrR\n");
    assert_eq!((channels.join(" ").as_str(), read), ("flexR flexL fsrL fsrR", 20));
    // Of the first name something is missing: nobody knows what it is.
    for cut in ["us,seq,flexR,flexL,fsrL,fsrR\n", "1,2,3,4\n", "\n"] {
        let (channels, read) = after(cut);
        assert!(!channels.contains(&"flexR".to_owned()) && read >= 18, "{cut}: {channels:?}, {read}");
    }
}

#[test]
fn the_message_of_a_board_that_starts_is_a_restart() {
    let lines = "flexL:1,flexR:2\n".repeat(20);
    for message in [
        "rst:0xf (RTCWDT_BROWN_OUT_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)\n",
        " ets Jan  8 2013,rst cause:4, boot mode:(3,7)\n",
    ] {
        let text = format!("{message}{lines}{message}{lines}");
        let (decoder, _) = hear([(0.0, text.as_bytes())]);
        assert_eq!(decoder.cadence().restarts, 1, "the first came with the connection: {message}");
    }
}
