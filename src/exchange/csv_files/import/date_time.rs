//! Dates and times of day as seconds.

/// Seconds of a date and time such as `2026-03-01T12:00:00.020Z`, `01.03.2026 12:00:00`, `2026/03/01 12:00:00 PM` or
/// `12:00:00.5`, from 1970 or midnight on.
pub(super) fn date_time_s(text: &str) -> Option<f64> {
    let half = [("AM", 0.0), ("PM", 12.0)].into_iter().find_map(|(end, hours)| {
        let (before, last) = text.split_at_checked(text.len().checked_sub(2)?)?;
        last.eq_ignore_ascii_case(end).then_some((before.trim_end(), hours))
    });
    let text = half.map_or(text, |(before, _)| before);
    let (date, time) = text.split_once(['T', ' ']).map_or((None, text), |(date, time)| (Some(date), time));
    let time = time.trim();
    let (clock, zone) = match time.find(['Z', '+', '-']) {
        Some(at) => time.split_at(at),
        None => (time, ""),
    };
    let numbers = |text: &str, separator: &[char]| -> Option<[f64; 3]> {
        let parts: Vec<&str> = text.split(separator).collect();
        let is_plain = |part: &&str| part.starts_with(|c: char| c.is_ascii_digit());
        let numbers: Vec<f64> =
            parts.iter().filter(|part| is_plain(part)).filter_map(|part| part.parse().ok()).collect();
        if parts.len() == 3 { numbers.try_into().ok() } else { None }
    };
    let [mut hour, minute, second] = numbers(&clock.replace(',', ".").replace("::", "."), &[':'])?;
    if !(hour < 24.0 && minute < 60.0 && second < 61.0 && hour.fract() == 0.0 && minute.fract() == 0.0) {
        return None;
    }
    if let Some((_, hours)) = half {
        hour = Some(hour).filter(|hour| (1.0..=12.0).contains(hour))? % 12.0 + hours;
    }
    let offset = match zone {
        "" | "Z" => 0.0,
        zone => {
            let (hours, minutes) = zone[1..].split_once(':').unwrap_or((&zone[1..], "0"));
            let [hours, minutes] = [hours, minutes].map(|part| part.parse::<u8>().ok());
            let seconds = 3600.0 * f64::from(hours?) + 60.0 * f64::from(minutes?);
            if zone.starts_with('-') { -seconds } else { seconds }
        }
    };
    let days = match date {
        None => 0.0,
        Some(date) => {
            let [year, month, day] = match numbers(date, &['-', '/', '.'])? {
                [day, month, year] if year >= 1970.0 && (date.contains('.') || day > 12.0) => [year, month, day],
                [month, day, year] if year >= 1970.0 && (day > 12.0 || day == month) => [year, month, day],
                year_first => year_first,
            };
            if !((1970.0..=9999.0).contains(&year) && (1.0..=12.0).contains(&month) && (1.0..=31.0).contains(&day)) {
                return None;
            }
            days_since_1970(year as i64, month as i64, day as i64) as f64
        }
    };
    Some(86_400.0 * days + 3600.0 * hour + 60.0 * minute + second - offset)
}

/// Days of the Gregorian calendar: whole years begin in March, so that the leap day is the last.
fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day - 1 - 719_468
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_and_clock_times_are_seconds() {
        // date -u -d 2026-03-01T12:00:00 +%s
        assert_eq!(date_time_s("2026-03-01T12:00:00.25Z"), Some(1_772_366_400.25));
        assert_eq!(date_time_s("2026/03/01 13:00:00,25+01:00"), Some(1_772_366_400.25));
        assert_eq!(date_time_s("2024-02-29 00:00:00"), Some(1_709_164_800.0));
        assert_eq!(date_time_s("01:02:03.5"), Some(3723.5));
        for text in ["01.03.2026 12:00:00", "3/13/2026 12:00:00 PM", "13-03-2026 12:00:00pm", "2026-03-13 12:00:00"] {
            let day = if text.starts_with("01") { 0.0 } else { 12.0 * 86_400.0 };
            assert_eq!(date_time_s(text), Some(1_772_366_400.0 + day), "{text}");
        }
        assert_eq!((date_time_s("12:00:01 AM"), date_time_s("1:00:00 pm")), (Some(1.0), Some(46_800.0)));
        for text in [
            "",
            "12:00",
            "3/4/2026 12:00:00",
            "13:00:00 PM",
            "0:00:00 AM",
            "AM",
            "2026-13-01 00:00:00",
            "25:00:00",
            "a:b:c",
            "2026-03-01",
            "1:2:3:4",
            "-1:00:00",
            "1:00:00+x",
        ] {
            assert_eq!(date_time_s(text), None, "{text}");
        }
    }
}
