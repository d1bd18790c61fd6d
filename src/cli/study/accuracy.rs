//! `palpate study accuracy`: what accuracy costs, and what it is worth.

use super::super::Failure;
use super::super::terminal::{say, say_json, table};
use super::files::{StudyOutput, note_stopped};
use palpate_geometry::units::three_digits;
use palpate_lab::study::accuracy::{AccuracyPlan, AccuracyStudy, SceneGroup, SettingFamily, accuracy_figure};
use palpate_lab::study::{StoredStudy, StudyCommand};
use palpate_learn::method;
use palpate_sim::objects::titled;

/// Arguments of `palpate study accuracy`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate study accuracy --quick
  palpate study accuracy --out accuracy/
  palpate study accuracy --poses 8 --json")]
pub(super) struct AccuracyArguments {
    /// Take less than a minute: two poses, fewer settings and methods.
    #[arg(long)]
    quick: bool,
    /// Poses of each object, free and fixed (default: 32, with --quick 2).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    poses: Option<u64>,
    #[command(flatten)]
    output: StudyOutput,
    /// Print one JSON object instead of tables.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &AccuracyArguments) -> Result<(), Failure> {
    let mut plan = if arguments.quick { AccuracyPlan::quick() } else { AccuracyPlan::full() };
    plan.poses = arguments.poses.unwrap_or(plan.poses);
    let folder = arguments.output.folder("accuracy", arguments.quick);
    let mut file = plan.open(&folder.units("accuracy"))?;
    let Some(study) = arguments.output.run(|how| plan.run(&mut file, how))?? else {
        note_stopped(&format!("{:.2} CPU hours", file.cpu_hours()));
        return Ok(());
    };
    let command = StudyCommand::new("accuracy").flag("quick", arguments.quick).option("poses", arguments.poses);
    let stored = StoredStudy::new(command.text(), file.cpu_hours(), study);
    let written = folder.write("accuracy", &stored, &accuracy_figure(&stored))?;
    if arguments.json {
        return say_json(&stored);
    }
    print(&stored.result)?;
    say("")?;
    say(format!("{}. {written}", stored.cpu_time()))
}

fn print(study: &AccuracyStudy) -> Result<(), Failure> {
    let objects: Vec<String> = study.objects.iter().map(|name| titled(name)).collect();
    for group in [SceneGroup::Free, SceneGroup::Fixed] {
        let front: Vec<_> = study.front(group).into_iter().map(|(setting, _)| setting).collect();
        let rows: Vec<Vec<String>> = SettingFamily::ALL
            .into_iter()
            .flat_map(|family| study.family(family, group))
            .map(|(setting, cost)| {
                vec![
                    setting.family.title().to_owned(),
                    setting.name.clone(),
                    three_digits(cost.cpu_ms.median),
                    three_digits(1e3 * cost.curvature_per_m.median),
                    three_digits(1e3 * cost.force_n.median),
                    cost.failed.to_string(),
                    if front.contains(&setting) { "*".to_owned() } else { String::new() },
                    setting.on_command_line(),
                ]
            })
            .collect();
        say(format!("{} objects, medians of {} poses of {}", group.title(), study.poses, objects.join(", ")))?;
        table(&["family", "setting", "CPU ms", "error 1/km", "error mN", "failed", "front", ""], &rows)?;
        say("")?;
    }
    let Some(first) = study.recognition.first() else { return Ok(()) };
    let keys: Vec<&str> = first.scores.iter().map(|score| score.method.as_str()).collect();
    let mut header = vec!["trained on", "setting", "CPU ms", "left out"];
    header.extend(keys.iter().map(|key| method(key).map_or(*key, |method| method.title)));
    let rows: Vec<Vec<String>> = study
        .recognition
        .iter()
        .map(|row| {
            let mut cells = vec![row.setting.family.title().to_owned(), row.setting.name.clone()];
            cells.extend([three_digits(row.cpu_ms), row.left_out.to_string()]);
            cells.extend(row.scores.iter().map(|score| format!("{:.3}", score.f1.estimate)));
            cells
        })
        .collect();
    table(&header, &rows)?;
    match study.knee() {
        Some(row) => {
            say(format!("Macro F1 on reference grasps. Knee: {}, {}", row.setting.family.title(), row.setting.name))
        }
        None => say("Macro F1 on reference grasps. No knee: every other setting is worse for some method"),
    }
}
