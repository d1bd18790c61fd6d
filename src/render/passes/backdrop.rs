//! The backdrop behind everything.

use super::build::{Depth, PictureShape, module, picture_pipeline};
use super::{Pass, PassSetup, Prepare};
use wgpu::{RenderPass, RenderPipeline};

struct Backdrop {
    pipeline: RenderPipeline,
}

pub(super) fn make(setup: &PassSetup<'_>) -> Box<dyn Pass> {
    let shader = module(setup.device, "backdrop", crate::shaders::BACKDROP);
    let pipeline = picture_pipeline(
        setup,
        &PictureShape {
            label: "backdrop",
            shader: &shader,
            vertex: "vertex",
            fragment: "fragment",
            buffers: &[],
            groups: &[],
            topology: wgpu::PrimitiveTopology::TriangleList,
            depth: Depth::OnTop,
            blends: false,
            culled: None,
        },
    );
    Box::new(Backdrop { pipeline })
}

impl Pass for Backdrop {
    fn prepare(&mut self, _prepare: &Prepare<'_>) {}

    fn draw(&self, pass: &mut RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.draw(0..3, 0..1);
    }
}
