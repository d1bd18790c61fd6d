//! Points of a calibration from a CSV file: `angle_deg` of a flex strip, or `load_kg` or `load_g` of a pad, beside
//! `counts`. Columns `spread` (counts) and `readings` may stand beside them; several rows of one angle or weight are
//! fine.

use palpate_tactile::calibration::{Point, SensorKind};
use std::path::Path;

/// Error of reading points, as a sentence.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct PointsError(String);

/// Most rows of a file of points.
const MOST_ROWS: usize = 10_000;

/// Names of the stimulus column, and the factor to degrees or kilograms.
fn stimulus_columns(kind: SensorKind) -> &'static [(&'static str, f64)] {
    match kind {
        SensorKind::Flex => &[("angle_deg", 1.0)],
        SensorKind::Pad => &[("load_kg", 1.0), ("load_g", 1e-3)],
        SensorKind::Raw => &[],
    }
}

/// Reads calibration points for a kind of sensor.
pub fn read_points_csv(path: &Path, kind: SensorKind) -> Result<Vec<Point>, PointsError> {
    let name = path.display();
    let unreadable = |cause: String| PointsError(format!("cannot read the points \"{name}\": {cause}"));
    let file = palpate_geometry::open_regular(path).map_err(|e| unreadable(e.to_string()))?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(file);
    let headers = reader.headers().map_err(|e| unreadable(e.to_string()))?.clone();
    let column = |name: &str| headers.iter().position(|header| header.eq_ignore_ascii_case(name));
    let missing = |wanted: &'static str| {
        let found = headers.iter().collect::<Vec<_>>().join(", ");
        PointsError(format!(
            "\"{name}\" has no column {wanted}; its first line must name the columns, as in \"{wanted},counts\" (it has: \
             {found})"
        ))
    };
    let known = stimulus_columns(kind);
    let stimulus = known.iter().find_map(|(name, factor)| Some((column(name)?, *factor)));
    let (stimulus, factor) = stimulus.ok_or_else(|| missing(known[0].0))?;
    let counts = column("counts").ok_or_else(|| missing("counts"))?;
    let (spread, readings) = (column("spread"), column("readings"));
    let mut points = Vec::new();
    for row in reader.records() {
        let row = row.map_err(|e| unreadable(e.to_string()))?;
        let line = row.position().map_or(0, csv::Position::line);
        let number = |column: usize| {
            let text = row.get(column).unwrap_or_default();
            text.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| {
                let column = headers.get(column).unwrap_or_default();
                PointsError(format!("\"{name}\", line {line}: {column} is \"{text}\", which is not a number"))
            })
        };
        points.push(Point {
            stimulus: kind.stimulus(factor * number(stimulus)?),
            counts: number(counts)?,
            spread: spread.map_or(Ok(0.0), number)?.max(0.0),
            readings: readings.map_or(Ok(1.0), number)?.clamp(1.0, 1e6) as u32,
        });
        if points.len() > MOST_ROWS {
            return Err(unreadable(format!("more than {MOST_ROWS} rows; a calibration needs only some points")));
        }
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, kind: SensorKind) -> Result<Vec<Point>, PointsError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("points.csv");
        std::fs::write(&path, text).expect("written");
        read_points_csv(&path, kind)
    }

    #[test]
    fn points_are_read_in_the_units_of_their_columns() -> Result<(), PointsError> {
        let points = read("# strip A7\nangle_deg, counts\n0, 1422\n90 , 2230.5\n", SensorKind::Flex)?;
        assert_eq!(points.len(), 2);
        assert!((points[1].stimulus - std::f64::consts::FRAC_PI_2).abs() < 1e-12 && points[1].counts == 2230.5);
        let points = read("counts,load_g,spread,readings\n0,0,0,1\n1800,100,2.1,50\n", SensorKind::Pad)?;
        assert!((points[1].stimulus - 0.980665).abs() < 1e-12);
        assert_eq!((points[1].spread, points[1].readings), (2.1, 50));
        assert!((read("load_kg,counts\n0.5,3000\n", SensorKind::Pad)?[0].stimulus - 4.903325).abs() < 1e-12);
        Ok(())
    }

    #[test]
    fn what_cannot_be_read_is_told_with_its_place() {
        let message = |text: &str, kind| read(text, kind).expect_err("refused").to_string();
        assert!(message("load_kg,counts\n0.5,3000\n", SensorKind::Flex).contains("no column angle_deg"));
        assert!(message("angle_deg,volts\n0,1\n", SensorKind::Flex).contains("it has: angle_deg, volts"));
        let text = message("angle_deg,counts\n0,1422\n90,open\n", SensorKind::Flex);
        assert!(text.contains("line 3") && text.contains("\"open\""), "{text}");
        assert!(message("angle_deg,counts\n0,nan\n", SensorKind::Flex).contains("not a number"));
        assert!(message("angle_deg,counts\n0\n", SensorKind::Flex).contains("points.csv"));
        let gone = read_points_csv(Path::new("/nowhere/p.csv"), SensorKind::Flex).expect_err("gone").to_string();
        assert!(gone.contains("/nowhere/p.csv"));
    }
}
