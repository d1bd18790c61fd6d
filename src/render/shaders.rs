//! Shader texts, put together from the files in `shaders/`.

macro_rules! shader {
    ($($file:literal),+) => {
        concat!($(include_str!(concat!("../../shaders/", $file)), "\n"),+)
    };
}

pub(crate) const BACKDROP: &str = shader!("common/frame.wgsl", "backdrop.wgsl");
pub(crate) const GROUND: &str = shader!("common/frame.wgsl", "common/light.wgsl", "ground.wgsl");
pub(crate) const SOLID: &str = shader!("common/frame.wgsl", "common/light.wgsl", "solid.wgsl");
pub(crate) const SKIN: &str = shader!("common/frame.wgsl", "common/light.wgsl", "skin.wgsl");
pub(crate) const ARROW: &str = shader!("common/frame.wgsl", "arrow.wgsl");
pub(crate) const OVERLAY: &str = shader!("common/frame.wgsl", "overlay.wgsl");
pub(crate) const AMBIENT: &str = shader!("common/frame.wgsl", "ambient.wgsl");
pub(crate) const BLIT: &str = shader!("blit.wgsl");

/// Every shader by name, so that tests can check them all without a graphics card.
pub fn all_shaders() -> [(&'static str, &'static str); 8] {
    [
        ("backdrop", BACKDROP),
        ("ground", GROUND),
        ("solid", SOLID),
        ("skin", SKIN),
        ("arrow", ARROW),
        ("overlay", OVERLAY),
        ("ambient", AMBIENT),
        ("blit", BLIT),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use naga::back::glsl;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    #[test]
    fn every_shader_is_valid_and_has_a_webgl2_form() {
        for (name, source) in all_shaders() {
            let module =
                naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
            let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
                .validate(&module)
                .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
            let options = glsl::Options {
                version: glsl::Version::Embedded { version: 300, is_webgl: true },
                ..glsl::Options::default()
            };
            for entry in &module.entry_points {
                let pipeline = glsl::PipelineOptions {
                    shader_stage: entry.stage,
                    entry_point: entry.name.clone(),
                    multiview: None,
                };
                let mut text = String::new();
                let mut writer = glsl::Writer::new(&mut text, &module, &info, &options, &pipeline, Default::default())
                    .unwrap_or_else(|e| panic!("{name}, {}: {e}", entry.name));
                writer.write().unwrap_or_else(|e| panic!("{name}, {}: {e}", entry.name));
            }
        }
    }

    #[test]
    fn every_shader_file_is_used() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shaders");
        let names: Vec<&str> = all_shaders().iter().map(|(name, _)| *name).collect();
        for file in std::fs::read_dir(folder).unwrap() {
            let path = file.unwrap().path();
            if let Some(stem) = path.file_stem().filter(|_| path.is_file()) {
                assert!(names.contains(&stem.to_str().unwrap()), "{} has no pass", path.display());
            }
        }
    }
}
