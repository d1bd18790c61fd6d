//! `palpate study public`: all methods on recordings of others.

use super::super::learning::read_dataset;
use super::super::prelude::*;
use super::super::trials::{MappingArguments, import_all};
use super::output::StudyOutput;
use palpate_lab::datasets::{DatasetQuery, SensorView};
use palpate_study::{PUBLIC, PublicData, PublishedResults, StudyCommand, public_study};

/// Arguments of `palpate study public`.
#[derive(Debug, clap::Args)]
#[command(after_help = "A file of published results has one table for each:

  [[published]]
  method = \"SVM\"
  result = \"accuracy 93 %\"
  protocol = \"ten folds\"
  source = \"Authors, Journal, year, table 2\"

Examples:
  palpate study public --data icub.csv
  palpate study public --data monday.csv tuesday.csv --label object --time 'timestamp [ms]' --quick
  palpate study public --data glove.csv --profile lab.toml --published glove.toml --out glove/

See also: palpate help recordings")]
pub(super) struct PublicArguments {
    /// CSV, MCAP, NPZ or Parquet files; each is a session, unless a column session names them.
    #[arg(long, required = true, num_args = 1.., value_name = "FILE")]
    data: Vec<PathBuf>,
    #[command(flatten)]
    mapping: MappingArguments,
    /// Published results on the same data, which are printed beside ours.
    #[arg(long, value_name = "FILE.toml")]
    published: Option<PathBuf>,
    /// Small networks and few epochs: quick, but worse results.
    #[arg(long)]
    quick: bool,
    /// Random seed of fits and splits.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    output: StudyOutput,
}

pub(super) fn run(arguments: &PublicArguments) -> Result<(), Failure> {
    let PublicArguments { data: files, mapping, published, quick, seed, output } = arguments;
    let (results, quick, seed) = (published.as_deref().map(read_published).transpose()?, *quick, *seed);
    let folder = output.folder(quick);
    // Grasps of other files, or read in another way, have a store of their own.
    let roles = mapping.mapping()?;
    let mut known = vec![format!("{roles:?}").into_bytes()];
    for file in files {
        known.push(std::fs::read(file).map_err(|cause| cannot_read(file, &cause))?);
    }
    let hash = palpate_sim::fingerprint(known.iter().map(Vec::as_slice));
    let mut store = Store::open(&folder.path().join(format!("{PUBLIC}-{hash:016x}.sqlite")))?;
    import_all(files, &roles, &mut store)?;
    let query = DatasetQuery { without_empty: true, ..DatasetQuery::default() };
    let data = read_dataset(&query, &store, &SensorView::default())?;
    let name = |file: &PathBuf| file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let names: Vec<String> = files.iter().map(name).collect();
    let command = StudyCommand::new(PUBLIC)
        .option("data", Some(names.join(" ")))
        .option("published", published.as_ref().map(name))
        .flag("quick", quick)
        .option("seed", (seed != 1).then_some(seed));
    let command = mapping.repeated(command);
    let about = names.join(", ");
    let study = public_study(PublicData { data, about, published: results.unwrap_or_default(), command, seed, quick });
    let stored = output.run(&study, quick)?;
    stored.filter(|_| output.json).map_or(Ok(()), |stored| say_json(&stored))
}

fn cannot_read(file: &Path, cause: &std::io::Error) -> Failure {
    format!("cannot read \"{}\": {cause}", file.display()).into()
}

fn read_published(file: &Path) -> Result<PublishedResults, Failure> {
    let text = std::fs::read_to_string(file).map_err(|cause| cannot_read(file, &cause))?;
    PublishedResults::parse(&text).map_err(|cause| {
        format!("\"{}\": {}; `palpate study public --help` shows such a file", file.display(), cause.trim()).into()
    })
}
