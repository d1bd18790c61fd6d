//! The result in tables, for the terminal, the manual and other programs.

use super::continuum::{Continuum, ContinuumPair};
use super::plan::{AccuracySetting, SettingFamily};
use super::report::{AccuracyStudy, GroupCost, MethodScore, RecognitionRow, SceneGroup};
use crate::frame::{Cell, Column, PERCENT, POINTS, StudyReport, StudyTable, TableRows};
use palpate_learn::metrics::Interval;

/// Cost and error of a setting in a kind of scene.
struct CostRow<'a> {
    setting: &'a AccuracySetting,
    cost: &'a GroupCost,
    /// True where nothing cheaper is as accurate.
    in_front: bool,
}

impl AccuracyStudy {
    /// Tables of cost and error for free and fixed objects and by kind of object, and of recognition.
    pub(super) fn shown(&self) -> StudyReport {
        let (free, fixed) = ([SceneGroup::Free], [SceneGroup::Fixed]);
        let kinds = &SceneGroup::ALL[2..];
        let mut tables = vec![
            self.costs("accuracy-free", "Cost and error, free objects", &free, &SettingFamily::ALL),
            self.costs("accuracy-fixed", "Cost and error, fixed objects", &fixed, &SettingFamily::ALL),
            self.costs("accuracy-kinds", "Tolerances by kind of object", kinds, &[SettingFamily::Tolerance]),
        ];
        let mut data = vec![format!(
            "Medians over {} shapes ({}) in {} poses each: CPU time of a grasp, error of curvature (with quartiles) and force \
             (RMS over the grasp), and the share of grasps that fail: they report a fault, or the object ends more than 5 mm \
             away. * marks the front: nothing cheaper is as accurate.",
            self.objects.len(),
            self.objects.join(", "),
            self.poses,
        )];
        if !self.recognition.is_empty() {
            let knee = match self.knee() {
                Some(row) => format!("The knee is {} ({}).", row.setting.name, row.setting.family.title()),
                None => "No setting is as good as the reference for every method.".to_owned(),
            };
            data.push(format!(
                "Models are trained on grasps of each setting and tested on reference grasps of other poses, through \
                 physical-like sensors. Macro F1 after one grasp, and the difference from training on reference grasps. {knee}"
            ));
            tables.push(self.recognition_table());
        }
        if let Some(continuum) = &self.continuum {
            data.push(continuum.about());
            tables.extend([continuum.pad_table(), continuum.finger_table()]);
        }
        StudyReport::new(data, tables, Vec::new())
    }

    fn costs(&self, name: &str, title: &str, groups: &[SceneGroup], families: &[SettingFamily]) -> StudyTable {
        let of_group = |group: &SceneGroup| {
            let (group, front) = (*group, self.front(*group));
            let settings = families.iter().flat_map(move |family| self.family(*family, group));
            let in_front = move |setting| front.iter().any(|(own, _)| *own == setting);
            settings.map(move |(setting, cost)| CostRow { setting, cost, in_front: in_front(setting) })
        };
        let rows: Vec<CostRow<'_>> = groups.iter().flat_map(of_group).collect();
        TableRows::new(name, title, &rows).columns(&[
            Column("objects", "", &|row| row.cost.group.title().into()),
            Column("family", "", &|row| row.setting.family.title().into()),
            Column("setting", "", &|row| {
                format!("{}{}", row.setting.name, if row.setting.is_default() { ", default" } else { "" }).into()
            }),
            Column("CPU", "ms", &|row| Some(row.cost.cpu_ms.median).into()),
            Column("curvature", "1/m", &|row| {
                let [low, estimate, high] = <[f64; 3]>::from(row.cost.curvature_per_m);
                Cell::Interval(Interval { estimate, low, high })
            }),
            Column("force", "mN", &|row| Some(1e3 * row.cost.force_n.median).into()),
            Column("failed", PERCENT, &|row| Some(row.cost.failed as f64 / row.cost.grasps.max(1) as f64).into()),
            Column("front", "", &|row| if row.in_front { "*" } else { "" }.into()),
            Column("options", "", &|row| row.setting.on_command_line().into()),
        ])
    }

    fn recognition_table(&self) -> StudyTable {
        let mut rows: Vec<(&RecognitionRow, &MethodScore)> = Vec::new();
        self.recognition.iter().for_each(|row| rows.extend(row.scores.iter().map(|score| (row, score))));
        TableRows::new("accuracy-recognition", "What it is worth: recognition", &rows).columns(&[
            Column("family", "", &|(row, _)| row.setting.family.title().into()),
            Column("setting", "", &|(row, _)| row.setting.name.as_str().into()),
            Column("CPU", "ms", &|(row, _)| Some(row.cpu_ms).into()),
            Column("left out", "grasps", &|(row, _)| row.left_out.into()),
            Column("method", "", &|(_, score)| score.method.as_str().into()),
            Column("F1", PERCENT, &|(_, score)| Some(score.f1).into()),
            Column("difference", POINTS, &|(_, score)| Some(score.gain).into()),
        ])
    }
}

impl Continuum {
    fn about(&self) -> String {
        let [(modulus, left), (along, left_along)] = self.best_factors();
        let percent = |log: f64| 100.0 * log.exp_m1();
        let within = self.pad.iter().filter(|row| (row.normal.ratio() - 1.0).abs() <= 0.05).count();
        format!(
            "Springs beside a continuum: forces of a bonded layer of incompressible rubber of the pad's modulus, by finite \
             elements (tests/peers/soft_pad.py), in N under the ball and N/m under the others. Of {} normal forces {within} are \
             within 5 % of ours. A modulus {modulus:.2} times ours fits best and leaves {:.0} % (RMS); along the pad it is \
             {along:.2} times ours and {:.0} %.",
            self.pad.len(),
            percent(left),
            percent(left_along),
        )
    }

    fn pad_table(&self) -> StudyTable {
        let pair = |pair: ContinuumPair| Cell::from(format!("{} / {}", pair.continuum, pair.ours));
        TableRows::new("accuracy-pad", "Springs beside a continuum: the pad (finite elements / ours)", &self.pad)
            .columns(&[
                Column("body", "", &|row| row.body.as_str().into()),
                Column("way", "", &|row| if row.slant_deg > 0.0 { "30° slanted" } else { "normal" }.into()),
                Column("friction", "", &|row| if row.sticks { "sticks" } else { "none" }.into()),
                Column("depth", "mm", &|row| Some(row.depth_mm).into()),
                Column("force", "N, N/m", &|row| pair(row.normal)),
                Column("ratio", "", &|row| Some(row.normal.ratio()).into()),
                Column("along", "N, N/m", &|row| row.along.map_or(Cell::Missing, pair)),
                Column("width", "mm", &|row| pair(row.width_mm)),
                Column("peak", "kPa", &|row| pair(row.peak_kpa)),
                Column("mesh", PERCENT, &|row| row.mesh_percent.map(|percent| 0.01 * percent).into()),
            ])
    }

    fn finger_table(&self) -> StudyTable {
        TableRows::new("accuracy-finger", "Joints beside a continuum: the finger under a load on its tip", &self.finger)
            .columns(&[
                Column("load F L² / E I", "", &|row| Some(row.load).into()),
                Column("tip angle", "°", &|row| Some(row.tip_angle_deg).into()),
                Column("solid", "of the length", &|row| Some(row.deflection.continuum).into()),
                Column("ours", "of the length", &|row| Some(row.deflection.ours).into()),
                Column("difference", PERCENT, &|row| Some(1.0 / row.deflection.ratio() - 1.0).into()),
            ])
    }
}
