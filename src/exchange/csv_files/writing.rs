//! CSV files, and trials of other programs as CSV.

use crate::format::ExchangeError;
use palpate_store::{FileKind, NewFile};
use palpate_tactile::Signals;
use std::path::Path;

/// Writes a file that appears whole or not at all, and its folder where there is none.
pub(super) fn write_file(
    path: &Path,
    kind: FileKind,
    fill: impl FnOnce(&mut csv::Writer<NewFile>) -> csv::Result<()>,
) -> Result<(), ExchangeError> {
    let write = || -> std::io::Result<()> {
        if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder)?;
        }
        let mut out = csv::Writer::from_writer(NewFile::create(path, kind)?);
        fill(&mut out)?;
        out.into_inner().map_err(|e| std::io::Error::other(e.to_string()))?.finish()
    };
    write().map_err(|cause| ExchangeError::cannot_write(path, &cause))
}

/// Shortest text that reads back as the same number.
pub(super) fn number(x: f64) -> String {
    x.to_string()
}

/// Writes an imported trial: time, then its channels unchanged.
pub(super) fn write_signals_csv(path: &Path, signals: &Signals) -> Result<(), ExchangeError> {
    write_file(path, FileKind::Csv, |out| {
        out.write_record(std::iter::once("t_s").chain(signals.channels.iter().map(String::as_str)))?;
        for (sample, t) in signals.t_s.iter().enumerate() {
            let text = |value: &f32| if value.is_nan() { String::new() } else { value.to_string() };
            let values = signals.row(sample).iter().map(text);
            out.write_record(std::iter::once(number(*t)).chain(values))?;
        }
        Ok(())
    })
}
