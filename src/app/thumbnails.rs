//! Small pictures of objects for lists: the built-in ones, and files opened lately, which a thread draws.

use palpate_lab::workers::{PORTRAIT_SIDE, PortraitJob, Wake};
use palpate_render::Picture;
use palpate_sim::objects::{catalogue, thumbnail};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Textures by the name of a class or the path of a file.
pub(super) struct Thumbnails {
    textures: BTreeMap<String, egui::TextureHandle>,
    job: PortraitJob,
    asked: BTreeSet<String>,
}

impl Thumbnails {
    /// Reads those of the built-in objects and starts the thread for the others.
    pub(super) fn start(ctx: &egui::Context, wake: Wake) -> std::io::Result<Self> {
        let mut textures = BTreeMap::new();
        for built_in in catalogue() {
            if let Some(picture) = thumbnail(&built_in.name).and_then(|bytes| Picture::from_png(bytes).ok()) {
                let size = [picture.width, picture.height];
                textures.insert(built_in.name.clone(), texture(ctx, &built_in.name, size, &picture.rgba));
            }
        }
        Ok(Self { textures, job: PortraitJob::start(wake)?, asked: BTreeSet::new() })
    }

    /// All that are ready.
    pub(super) fn textures(&self) -> &BTreeMap<String, egui::TextureHandle> {
        &self.textures
    }

    /// Takes in what has been drawn, and asks for the next of these files. A file is drawn once, and the next one only when
    /// the one before is here: the thread keeps its newest picture alone.
    pub(super) fn gather(&mut self, ctx: &egui::Context, files: &[String]) {
        if !self.job.is_settled() {
            return;
        }
        if let Some(portrait) = self.job.view()
            && let Some(rgba) = &portrait.rgba
            && !self.textures.contains_key(&portrait.source)
        {
            let drawn = texture(ctx, &portrait.source, [PORTRAIT_SIDE; 2], rgba);
            // Trials and classes name an object without its folder.
            let stem = Path::new(&portrait.source).file_stem().and_then(|stem| stem.to_str());
            // Of files with one name the newest counts, but never before a built-in object.
            if let Some(stem) = stem.filter(|stem| thumbnail(stem).is_none()) {
                self.textures.insert(stem.to_owned(), drawn.clone());
            }
            self.textures.insert(portrait.source.clone(), drawn);
        }
        if let Some(next) = files.iter().find(|file| !self.asked.contains(*file)) {
            self.asked.insert(next.clone());
            self.job.ask(next.clone());
        }
    }
}

fn texture(ctx: &egui::Context, name: &str, size: [u32; 2], rgba: &[u8]) -> egui::TextureHandle {
    let image = egui::ColorImage::from_rgba_unmultiplied(size.map(|side| side as usize), rgba);
    ctx.load_texture(name, image, egui::TextureOptions::LINEAR)
}
