//! Texts that never get smaller than the smallest letters.

use egui::text::{LayoutJob, TextWrapping};
use egui::{Color32, FontId, Galley, Ui};
use std::sync::Arc;

/// One line, smaller where it needs more than the width; where the smallest letters do not suffice, it is cut.
pub(super) fn line(ui: &Ui, text: &str, letters: f32, width: f32, ink: Color32, least: f32) -> Arc<Galley> {
    let whole = ui.painter().layout_no_wrap(text.to_owned(), FontId::proportional(letters), ink);
    if whole.size().x <= width {
        return whole;
    }
    let smaller = (0.98 * letters * width / whole.size().x).clamp(least.min(letters), letters);
    let mut job = LayoutJob::simple_singleline(text.to_owned(), FontId::proportional(smaller), ink);
    job.wrap = TextWrapping::truncate_at_width(width.max(1.0));
    ui.painter().layout_job(job)
}

/// At most so many rows; numbers keep their units.
pub(super) fn paragraph(ui: &Ui, text: &str, letters: f32, width: f32, ink: Color32, rows: usize) -> Arc<Galley> {
    let text = text.replace(" %", "\u{a0}%").replace(" mm", "\u{a0}mm").replace(" N", "\u{a0}N");
    let mut job = LayoutJob::simple(text, FontId::proportional(letters), ink, width.max(1.0));
    job.wrap.max_rows = rows;
    ui.painter().layout_job(job)
}
