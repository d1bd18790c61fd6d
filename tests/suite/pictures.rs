//! Golden pictures of what needs a graphics driver: the off-screen view and the whole window. Drawn through OpenGL,
//! whose software rasteriser is the same everywhere; without any driver these tests fail and name the package.

use crate::bench::{Bench, BenchSetup};
use crate::golden::{compare, sheet};
use crate::inspect::three_trials;
use crate::presenter::texts;
use egui_kittest::wgpu::{WgpuTestRenderer, create_render_state};
use glam::{Vec2, Vec3};
use image::RgbaImage;
use palpate_geometry::drawing::{Align, DrawList, Shape2, Solid, StandardView};
use palpate_geometry::palette::Theme;
use palpate_lab::grasping::grasp;
use palpate_lab::picture::{PictureView, Stage};
use palpate_lab::workers::Command;
use palpate_render::{DriverChoice, Gpu, Picture, Renderer, wanted_limits, wgpu};
use palpate_sim::frame::Frame;
use palpate_sim::objects::{EMPTY, catalogue};
use palpate_sim::scene::{Scene, SupportKind};
use palpate_store::{Store, TrialQuery};
use std::sync::Arc;

fn driver() -> Gpu {
    Gpu::headless(DriverChoice::OpenGl).unwrap_or_else(|error| panic!("{error}"))
}

struct Shot {
    object: &'static str,
    /// Which moment (s).
    at: f64,
    view: StandardView,
    theme: Theme,
    size: [u32; 2],
    forces: bool,
    annotations: bool,
    /// The other engine's run is laid over it.
    ghost: bool,
}

const HELD: Shot = Shot {
    object: "lemon",
    at: 2.9,
    view: StandardView::Home,
    theme: Theme::Dark,
    size: [250, 170],
    forces: true,
    annotations: true,
    ghost: false,
};

/// The grasp of an object until a time (s): the last frame is the moment then.
fn grasped(scene: &Scene, object: &str, until: f64) -> (Stage, Vec<Frame>) {
    let mut scene = scene.clone();
    object.clone_into(&mut scene.object.source);
    let object = scene.load_object().unwrap();
    let trial = grasp(&scene, object.as_ref(), 0);
    let count = trial.frames().iter().position(|frame| frame.t > until - 1e-9).unwrap() + 1;
    (Stage::new(&scene, object.as_ref(), trial.data.world_from_gripper), trial.frames()[..count].to_vec())
}

fn take(gpu: &Gpu, renderer: &mut Renderer, scene: &Scene, shot: &Shot) -> RgbaImage {
    let (stage, frames) = grasped(scene, shot.object, shot.at);
    let frame = frames.last().unwrap();
    let view = PictureView {
        full_scale: stage.full_scale_of(&frames),
        theme: shot.theme,
        size: Vec2::new(shot.size[0] as f32, shot.size[1] as f32),
        forces: shot.forces,
        annotations: shot.annotations,
        badge: shot.annotations.then(|| "SIMULATED".to_owned()),
        ..PictureView::default()
    };
    let camera = stage.camera(shot.view, frame, &view);
    let mut list = stage.draw(frame, &PictureView { camera, ..view });
    if shot.ghost {
        let mut scene = scene.clone();
        scene.solver.engine = scene.solver.engine.other();
        let (_, other) = grasped(&scene, shot.object, shot.at);
        list.ghosts = stage.ghosts(other.last().unwrap(), shot.theme);
    }
    let picture = Picture::draw(gpu, renderer, &list, shot.size, 1.0).unwrap();
    RgbaImage::from_raw(picture.width, picture.height, picture.rgba).unwrap()
}

#[test]
fn held_objects_from_several_sides() {
    let gpu = driver();
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue);
    let mut views = Vec::new();
    let mut check = |shot: &Shot, scene: &Scene| views.push(take(&gpu, &mut renderer, scene, shot));
    let scene = Scene::default();
    check(&HELD, &scene);
    check(&Shot { theme: Theme::Light, ..HELD }, &scene);
    check(&Shot { object: "ball", ghost: true, view: StandardView::Front, ..HELD }, &scene);
    check(&Shot { object: "box", view: StandardView::Front, ..HELD }, &scene);
    check(&Shot { object: "syringe", view: StandardView::Top, theme: Theme::Light, ..HELD }, &scene);
    check(&Shot { object: EMPTY, at: 0.0, forces: false, ..HELD }, &scene);
    let mut table = Scene::default();
    table.support.kind = SupportKind::Table;
    table.gripper.finger.joints = 40;
    check(&Shot { object: "metalbrick", annotations: false, ..HELD }, &table);
    compare("views", &sheet(&views, 3), &gpu.driver);
}

#[test]
fn the_sixteen_look_like_what_they_are() {
    let gpu = driver();
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue);
    let mut held = |object: &'static str| {
        let shot = Shot { object, size: [160, 112], forces: false, annotations: false, ..HELD };
        take(&gpu, &mut renderer, &Scene::default(), &shot)
    };
    let pictures: Vec<RgbaImage> = catalogue().iter().map(|built_in| held(&built_in.name)).collect();
    compare("the_sixteen_held", &sheet(&pictures, 4), &gpu.driver);
}

/// Share of a picture that is pad coloured by its load: the pixels that change where the pads keep their shape and lose their
/// pressure.
fn coloured_share(gpu: &Gpu, renderer: &mut Renderer, list: &DrawList, size: [u32; 2]) -> f64 {
    let mut without = list.clone();
    let loads = without.fingers.iter_mut().flat_map(|finger| &mut finger.taxels.loads);
    loads.for_each(|load| load[0] = 0.0);
    let mut draw = |list: &DrawList| Picture::draw(gpu, renderer, list, size, 1.0).unwrap().rgba;
    let (with, without) = (draw(list), draw(&without));
    let pixels = with.chunks_exact(4).zip(without.chunks_exact(4));
    let changed = pixels.filter(|(a, b)| (0..3).any(|k| a[k].abs_diff(b[k]) > 8)).count();
    changed as f64 / f64::from(size[0] * size[1])
}

#[test]
fn the_touch_is_seen_in_the_hold_of_each_of_the_sixteen() {
    let gpu = driver();
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue);
    let mut shares = Vec::new();
    for built_in in catalogue() {
        let (stage, frames) = grasped(&Scene::default(), &built_in.name, HELD.at);
        let (frame, full_scale) = (frames.last().unwrap(), stage.full_scale_of(&frames));
        let view = PictureView { size: Vec2::new(1280.0, 800.0), full_scale, ..PictureView::default() };
        let camera = stage.camera(StandardView::Home, frame, &view);
        let inset = stage.draw(frame, &PictureView { camera, ..view }).inset.expect("something is touched");
        let size = inset.size.round().as_uvec2().to_array();
        let share = coloured_share(&gpu, &mut renderer, &inset.list, size);
        shares.push((built_in.name.clone(), share));
    }
    assert!(shares.iter().all(|(_, share)| *share >= 0.01), "{shares:?}");
}

/// Place of each text of a picture (points): the letters of its font are half as wide as high.
fn text_places(list: &DrawList) -> Vec<(String, Vec2, Vec2)> {
    let place = |shape: &Shape2| {
        let Shape2::Text { at, align, size, text, .. } = shape else { return None };
        let width = 0.5 * size * text.chars().count() as f32;
        let left = match align {
            Align::Left => at.x,
            Align::Centre => at.x - 0.5 * width,
            Align::Right => at.x - width,
        };
        let low = Vec2::new(left, at.y - 0.5 * size);
        Some((text.clone(), low, low + Vec2::new(width, *size)))
    };
    list.overlay.shapes.iter().filter_map(place).collect()
}

#[test]
fn the_numbers_of_each_hold_are_there_and_cover_nothing() {
    for (built_in, theme) in catalogue().iter().flat_map(|built_in| Theme::ALL.map(|theme| (built_in, theme))) {
        let (stage, frames) = grasped(&Scene::default(), &built_in.name, HELD.at);
        let frame = frames.last().unwrap();
        // The 3-D view of a window of 1280 x 800, and of 960 x 600.
        for (size, curvatures) in [(Vec2::new(710.0, 376.0), 2), (Vec2::new(532.0, 260.0), 0)] {
            let view = PictureView { size, theme, ..PictureView::default() };
            let camera = stage.camera(StandardView::Home, frame, &view);
            let list = stage.draw(frame, &PictureView { camera, ..view });
            let name = format!("{}, {theme:?}, {size}", built_in.name);
            let mut places = text_places(&list);
            // Their grounds are a little larger than the texts.
            let fingers = hand_in_picture(&DrawList { solids: Vec::new(), ..list.clone() }, size);
            let covers = |(_, low, high): &&(String, Vec2, Vec2)| {
                fingers.iter().any(|at| at.cmpgt(*low).all() && at.cmplt(*high).all())
            };
            let covering = places.iter().find(covers).map(|(text, ..)| text);
            assert_eq!(covering, None, "{name}: it covers a finger");
            let count = |part: &str| places.iter().filter(|(text, ..)| text.contains(part)).count();
            assert_eq!([count("L  "), count("R  ")].map(|count| count > 0), [true; 2], "{name}");
            assert!(count("m\u{207b}\u{b9}") >= curvatures, "{name}");
            assert_eq!(count("mm"), 1, "{name}");
            places.extend(list.inset.iter().map(|own| ("inset".to_owned(), own.corner, own.corner + own.size)));
            for (k, (text, low, high)) in places.iter().enumerate() {
                assert!(low.min_element() >= 0.0 && high.cmple(size).all(), "{name}: {text} is cut off");
                for (other, from, to) in &places[k + 1..] {
                    let apart = low.cmpge(*to).any() || from.cmpge(*high).any();
                    assert!(apart, "{name}: {text} and {other} overlap");
                }
            }
        }
    }
}

/// Corners of everything in the hand and below it, in a picture of this size (points).
fn hand_in_picture(list: &DrawList, size: Vec2) -> Vec<Vec2> {
    let solid = |solid: &Solid| -> Vec<Vec3> {
        let place = solid.world_from_mesh;
        solid.mesh.vertices.iter().map(|vertex| place.transform_point3(vertex.position.into())).collect()
    };
    let mut points: Vec<Vec3> = list.solids.iter().flat_map(solid).collect();
    for finger in &list.fingers {
        let (half, section) = (0.5 * finger.section.width, finger.section);
        for frame in &finger.frames {
            let across = frame.inward.cross(frame.along) * half;
            for inward in [section.pad, -section.back] {
                points.extend([-1.0, 1.0].map(|sign| frame.position + across * sign + frame.inward * inward));
            }
        }
    }
    points.into_iter().map(|point| list.camera.project(point, size).expect("in front of the eye")).collect()
}

#[test]
fn the_home_view_shows_the_whole_hand_beside_the_inset() {
    for (k, built_in) in catalogue().iter().enumerate() {
        let mut scene = Scene::default();
        scene.gripper.mount.yaw_deg = [0.0, 35.0, -50.0, 80.0][k % 4];
        let (stage, frames) = grasped(&scene, &built_in.name, HELD.at);
        for frame in [&frames[0], frames.last().unwrap()] {
            for size in
                [[640.0, 400.0], [1000.0, 420.0], [720.0, 660.0], [440.0, 260.0], [1280.0, 800.0], [360.0, 520.0]]
            {
                let size = Vec2::from(size);
                let view = PictureView { size, ..PictureView::default() };
                let camera = stage.camera(StandardView::Home, frame, &view);
                let list = stage.draw(frame, &PictureView { camera, ..view });
                let hand = hand_in_picture(&list, size);
                let low = hand.iter().copied().reduce(Vec2::min).unwrap();
                let high = hand.iter().copied().reduce(Vec2::max).unwrap();
                let told = format!("{} at {:.1} s in {size}: {low} to {high}", built_in.name, frame.t);
                assert!(low.min_element() > 0.0 && high.cmplt(size).all(), "cut: {told}");
                let filled = ((high - low) / size).max_element();
                assert!((0.7..=0.9).contains(&filled), "fills {filled}: {told}");
                // A pad faces the eye.
                let back = list.camera.axes()[2];
                assert!(list.fingers.iter().any(|finger| finger.frames[0].inward.dot(back) > 0.4), "{told}");
                // High and narrow pictures may have no room for it.
                assert!(list.inset.is_some() != frame.taxels.is_empty() || size.x < size.y, "{told}");
                let Some(inset) = &list.inset else { continue };
                let end = inset.corner + inset.size;
                assert!(inset.corner.min_element() > 0.0 && end.cmplt(size).all(), "{told}");
                let covered = hand.iter().find(|at| at.cmpgt(inset.corner).all() && at.cmplt(end).all());
                assert_eq!(covered, None, "inset at {} to {end}: {told}", inset.corner);
                assert!(inset.size.y >= 0.2 * size.y || size.x < size.y, "{}: {told}", inset.size);
            }
        }
    }
}

#[test]
fn the_ghost_of_a_finished_grasp_has_both_captions() {
    let mut bench = window(Theme::Dark, [1280.0, 820.0]);
    bench.tell(|app| app.set_ghost(true));
    bench.tell(|app| app.simulation.send(Command::SetSpeed(64.0)));
    bench.tell(|app| app.simulation.send(Command::Play));
    bench.until(|s| s.status.finished);
    let says = |bench: &Bench| {
        let both =
            ["The same grasp by the engine rapier: its fingers differ by up to ", "As it was held, at 3.0\u{a0}s"];
        texts(bench).iter().any(|(.., text)| both.iter().all(|part| text.replace('\n', " ").contains(part)))
    };
    while !says(&bench) {
        bench.wait();
    }
    // Its numbers are those of the time that is shown.
    bench.tell(|app| app.show_panel("grasp"));
    bench.until_shown(true, "at 3.00\u{a0}s");
}

/// The window through the driver that the pictures above are drawn with.
fn window(theme: Theme, size: [f32; 2]) -> Bench {
    window_on(theme, size, |_| ())
}

fn window_on(theme: Theme, size: [f32; 2], fill: fn(&mut Store)) -> Bench {
    let mut setup = egui_wgpu::WgpuSetupCreateNew::without_display_handle();
    setup.instance_descriptor.backends = wgpu::Backends::GL;
    setup.device_descriptor =
        Arc::new(|adapter| wgpu::DeviceDescriptor { required_limits: wanted_limits(adapter), ..Default::default() });
    let state = create_render_state(setup.into(), egui_wgpu::RendererOptions::PREDICTABLE);
    let setup = BenchSetup { theme, size, render_state: Some(state.clone()), fill, ..BenchSetup::default() };
    Bench::new(setup, WgpuTestRenderer::from_render_state(state))
}

#[test]
fn the_window_in_both_themes_and_small() {
    let by = driver().driver;
    for (name, theme, size) in [
        ("window_dark", Theme::Dark, [1280.0, 820.0]),
        ("window_light", Theme::Light, [760.0, 500.0]),
        ("window_keys", Theme::Dark, [720.0, 480.0]),
    ] {
        let mut bench = window(theme, size);
        bench.advance_to(2.6);
        if name == "window_keys" {
            bench.tell(|app| app.view.keys_shown = true);
            bench.harness.run_steps(3);
        }
        compare(name, &bench.picture(), &by);
    }
}

#[test]
fn stored_trials_are_compared_in_both_themes() {
    let by = driver().driver;
    for (name, theme, size) in
        [("inspect_dark", Theme::Dark, [960.0, 640.0]), ("inspect_light", Theme::Light, [760.0, 500.0])]
    {
        let mut bench = window_on(theme, size, three_trials);
        bench.tell(|app| app.open_trial(1));
        bench.until_shown(true, "TRIAL 1, SIMULATED");
        bench.tell(|app| app.pin(2));
        bench.until_shown(true, "Tomato, trial 2, simulated");
        // The list has dates, which differ from day to day.
        bench.tell(|app| app.library.find(TrialQuery { search: "in no trial".to_owned(), ..TrialQuery::default() }));
        bench.until_shown(true, "0 of 3 trials");
        // What is computed in the background is done.
        bench.harness.run_steps(8);
        compare(name, &bench.picture(), &by);
    }
}

#[test]
fn a_plain_picture_has_one_force_for_each_finger_and_its_inset_hides_no_arrow() {
    // The picture of presenter mode in a window of 960 x 600 points, with its larger letters.
    let size = Vec2::new(462.0, 458.0);
    for object in ["lemon", "tomato", "cube", "smallbutton"] {
        let (stage, frames) = grasped(&Scene::default(), object, 2.9);
        let frame = frames.last().unwrap();
        let view = PictureView { plain: true, inset: 0.38, size, ..PictureView::default() };
        let camera = stage.camera(StandardView::Home, frame, &view);
        let list = stage.draw(frame, &PictureView { camera, ..view });
        assert_eq!(list.arrows.len(), 2, "{object}");
        let says = |wanted: &str| {
            list.overlay.shapes.iter().any(|shape| matches!(shape, Shape2::Text { text, .. } if text == wanted))
        };
        for (letter, force) in ["L", "R"].into_iter().zip(stage.finger_forces(frame)) {
            let number = palpate_geometry::units::shown(force.expect("touches"), "N");
            assert!(says(&format!("{letter}  {number}")), "{object}: {letter} {number}");
        }
        let inset = list.inset.as_ref().expect("has room");
        for arrow in &list.arrows {
            let tip = camera.project(arrow.to, size).expect("in sight");
            let is_covered = (tip - inset.corner - 0.5 * inset.size).abs().cmplt(0.5 * inset.size).all();
            assert!(!is_covered, "{object}: the inset covers the tip at {tip}");
        }
    }
}
