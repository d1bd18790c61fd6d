//! Small pictures of objects for lists: the built-in ones, and files opened lately, which are drawn beside the window.

use palpate_lab::workers::{Job, PORTRAIT_SIDE, Wake, portrait_job};
use palpate_render::Picture;
use palpate_sim::objects::{catalogue, thumbnail};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Pictures by the name of a class or the path of a file.
pub(super) struct Thumbnails {
    textures: BTreeMap<String, egui::TextureHandle>,
    portraits: Job<String, Vec<u8>>,
    asked: BTreeSet<String>,
}

impl Thumbnails {
    /// Reads those of the built-in objects.
    pub(super) fn new(ctx: &egui::Context, wake: Wake) -> Self {
        let mut textures = BTreeMap::new();
        for built_in in catalogue() {
            if let Some(picture) = thumbnail(&built_in.name).and_then(|bytes| Picture::from_png(bytes).ok()) {
                let size = [picture.width, picture.height];
                textures.insert(built_in.name.clone(), texture(ctx, &built_in.name, size, &picture.rgba));
            }
        }
        Self { textures, portraits: portrait_job(wake), asked: BTreeSet::new() }
    }

    /// Picture of an object, once it is ready.
    pub(super) fn get(&self, name: &str) -> Option<&egui::TextureHandle> {
        self.textures.get(name)
    }

    /// Takes in what has been drawn, and has each of these files drawn once; a learned class has the picture of its file.
    pub(super) fn poll<'a>(
        &mut self,
        ctx: &egui::Context,
        files: &[String],
        learned: impl Iterator<Item = (&'a str, &'a str)>,
    ) {
        for ended in self.portraits.take() {
            let (source, Ok(rgba)) = (&*ended.command, ended.outcome) else { continue };
            let drawn = texture(ctx, source, [PORTRAIT_SIDE; 2], &rgba);
            // Trials and classes name an object without its folder.
            let stem = Path::new(source).file_stem().and_then(|stem| stem.to_str());
            // Of files with one name the newest counts, but never before a built-in object.
            if let Some(stem) = stem.filter(|stem| thumbnail(stem).is_none()) {
                self.textures.insert(stem.to_owned(), drawn.clone());
            }
            self.textures.insert(source.clone(), drawn);
        }
        for (class, file) in learned {
            if let Some(picture) = self.textures.get(file).filter(|_| !self.textures.contains_key(class)).cloned() {
                self.textures.insert(class.to_owned(), picture);
            }
        }
        for file in files {
            if self.asked.insert(file.clone()) {
                self.portraits.start(file.clone());
            }
        }
    }
}

fn texture(ctx: &egui::Context, name: &str, size: [u32; 2], rgba: &[u8]) -> egui::TextureHandle {
    let image = egui::ColorImage::from_rgba_unmultiplied(size.map(|side| side as usize), rgba);
    ctx.load_texture(name, image, egui::TextureOptions::LINEAR)
}
