//! `palpate movie`: a stored trial, or presenter mode, as an animated picture, without a window.

use super::output::{TemporaryFolder, cannot};
use super::prelude::*;
use super::snapshot::{Drawer, OpenDrawable, open_drawable, sides_from};
use crate::app::{Mode, OffscreenWindow, film_presentation};
use glam::Vec2;
use palpate_exchange::glb;
use palpate_geometry::drawing::StandardView;
use palpate_geometry::palette::Theme;
use palpate_lab::inspection::{OpenTrial, caption};
use palpate_lab::picture::PictureView;
use palpate_render::{DriverChoice, MovieFormat, MovieWriter, Picture};
use palpate_sim::frame::Frame;
use palpate_sim::scene::Scene;
use palpate_store::{NewFile, NewFolder};
use std::io::Write as _;
use std::process::{Child, Command, Stdio};

/// Arguments of `palpate movie`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate movie 1 --out grasp.apng
  palpate movie 1 --view front --speed 0.25 --from 0.5 --to 1.5 --out contact.gif
  palpate movie 1 --size 1280x800 --fps 30 --out frames/
  palpate movie 1 --out grasp.mp4
  palpate movie 1 --out grasp.glb

  palpate movie --demo 60 --size 1280x800 --fps 10 --out demo/

A folder gets a PNG file per picture, for any other encoder. An .mp4 is written by ffmpeg, where that is installed.
A .glb is an animated 3-D model (glTF 2.0) for viewers, Blender and slides: hand, object and skinned fingers, with the \
pressure as colours of their corners. It is seen from anywhere, in the light of its viewer: --view, --size, --theme, \
--no-forces and --bare do not apply. Fingers of the real gripper are drawn as arcs of the curvature that their strips read.")]
pub(super) struct MovieArguments {
    /// Trial number.
    #[arg(required_unless_present = "demo", conflicts_with = "demo")]
    trial: Option<TrialId>,
    /// Film so many seconds of presenter mode instead of a trial: object after object, recognised live.
    #[arg(long, value_name = "SECONDS", value_parser = within(0.1..=600.0), conflicts_with_all = ["view", "from", "to", "no_forces", "bare"])]
    demo: Option<f64>,
    /// View: hand, front, back, left, right, top or bottom.
    #[arg(long, value_name = "NAME", default_value = "hand", value_parser = one_of(StandardView::ALL.map(|view| (view.name(), view))))]
    view: StandardView,
    /// Width and height in pixels.
    #[arg(long, value_name = "WxH", default_value = "640x400", value_parser = sides_from(16))]
    size: [u32; 2],
    /// Theme: dark or light.
    #[arg(long, value_name = "NAME", default_value = "dark", value_parser = one_of(Theme::ALL.map(|theme| (theme.name(), theme))))]
    theme: Theme,
    /// Speed, as a multiple of real time.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = within(0.01..=64.0))]
    speed: f64,
    /// Time of the first picture (s; default: the first sample).
    #[arg(long, value_name = "SECONDS")]
    from: Option<f64>,
    /// Time of the last picture (s; default: the last sample).
    #[arg(long, value_name = "SECONDS")]
    to: Option<f64>,
    /// Pictures per second.
    #[arg(long, value_name = "N", default_value_t = 25.0, value_parser = within(1.0..=100.0))]
    fps: f64,
    /// Leave out force arrows.
    #[arg(long)]
    no_forces: bool,
    /// Leave out axis gizmo, scale bar and legend.
    #[arg(long)]
    bare: bool,
    /// File to write (.apng, .png, .gif, .mp4 or .glb), or a folder for one PNG file per picture.
    #[arg(long, value_name = "PATH", value_parser = file_or_folder(KINDS))]
    out: PathBuf,
}

/// Most pictures: ten minutes at 25 per second.
const MOST_PICTURES: f64 = 15_000.0;

pub(super) fn run(arguments: &MovieArguments, store: Option<&Path>) -> Result<(), Failure> {
    check_target(&arguments.out)?;
    if arguments.demo.is_some() && kind_of(&arguments.out) == Some(GLB) {
        return Err("a .glb holds one grasp: name a trial in place of --demo".into());
    }
    let Some(id) = arguments.trial else { return film(arguments) };
    let store = read_store(store)?;
    let open = open_drawable(&store, id)?;
    let times = times(arguments, &open.trial)?;
    let full_scale = open.stage.full_scale_of(open.trial.frames.iter().map(AsRef::as_ref));
    if kind_of(&arguments.out) == Some(GLB) {
        return write_model(arguments, &open, &times, full_scale);
    }
    let mut shot = Shot { drawer: Drawer::new(DriverChoice::Any)?, open: &open, full_scale, arguments };
    write(arguments, times.len(), |add| {
        times.iter().enumerate().try_for_each(|(number, t_s)| add(number, &shot.picture(*t_s)?))
    })
}

/// Writes the 3-D model of a trial.
fn write_model(arguments: &MovieArguments, open: &OpenDrawable, times: &[f64], full_scale: f32) -> Result<(), Failure> {
    let shown = |(k, t_s): (usize, &f64)| {
        let frame = open.trial.at(*t_s).and_then(|now| now.frame)?;
        Some(((k as f64 / arguments.fps) as f32, frame.as_ref()))
    };
    let frames: Vec<(f32, &Frame)> = times.iter().enumerate().filter_map(shown).collect();
    let about = caption(&[&open.trial]);
    let bytes = glb(&open.stage, &frames, full_scale, &about).ok_or("the trial has no samples")?;
    write_new(&arguments.out, GLB, &bytes)?;
    note(&format!("{} key frames, {:.1} MB", frames.len(), bytes.len() as f64 / 1e6));
    say(arguments.out.display())
}

/// Films presenter mode, with a store of its own.
fn film(arguments: &MovieArguments) -> Result<(), Failure> {
    let step_s = step_s(arguments);
    let pictures = count(arguments.demo.unwrap_or_default(), step_s)?;
    let folder = TemporaryFolder::new()?;
    let window = OffscreenWindow {
        scene: Scene::default(),
        store: folder.path().join("trials.sqlite"),
        mode: Mode::Demo,
        theme: arguments.theme,
        size: arguments.size,
        trial: None,
        at_s: 0.0,
        driver: DriverChoice::Any,
    };
    write(arguments, pictures, |add| film_presentation(&window, pictures, step_s, add))
}

/// Times of the pictures (s).
fn times(arguments: &MovieArguments, open: &OpenTrial) -> Result<Vec<f64>, Failure> {
    let [first, last] = open.span_s();
    let (from, to) = (arguments.from.unwrap_or(first), arguments.to.unwrap_or(last));
    // The first sample is not at zero, from which people count.
    let within = |t: f64| (first.min(0.0) - 1e-9..=last + 1e-9).contains(&t);
    if !within(from) || !within(to) || from > to {
        let text = format!(
            "trial {} runs from {first:.3} s to {last:.3} s: choose --from and --to within it, in this order",
            open.id
        );
        return Err(text.into());
    }
    let step_s = step_s(arguments);
    Ok((0..count(to - from, step_s)?).map(|k| from + step_s * k as f64).collect())
}

/// Time from one picture to the next (s).
fn step_s(arguments: &MovieArguments) -> f64 {
    arguments.speed / arguments.fps
}

/// Number of pictures of a span of time (s).
fn count(span_s: f64, step_s: f64) -> Result<usize, Failure> {
    let count = (span_s / step_s + 1e-9).floor() + 1.0;
    if count > MOST_PICTURES {
        let text = format!("{count:.0} pictures are more than {MOST_PICTURES:.0}: raise --speed, or lower --fps");
        return Err(text.into());
    }
    Ok(count as usize)
}

/// Draws pictures of a trial.
struct Shot<'a> {
    drawer: Drawer,
    open: &'a OpenDrawable,
    /// Pressure that has the brightest colour (Pa).
    full_scale: f32,
    arguments: &'a MovieArguments,
}

impl Shot<'_> {
    fn picture(&mut self, t_s: f64) -> Result<Picture, Failure> {
        let Self { drawer, open, full_scale, arguments } = self;
        let OpenDrawable { stage, trial } = open;
        let now = trial.at(t_s).and_then(|now| now.frame).ok_or("the trial has no samples")?;
        let [width, height] = arguments.size.map(|side| side as f32);
        let view = PictureView {
            theme: arguments.theme,
            size: Vec2::new(width, height),
            forces: !arguments.no_forces,
            annotations: !arguments.bare,
            full_scale: *full_scale,
            badge: (!arguments.bare).then(|| format!("{}, {t_s:.2} s", open.badge())),
            ..PictureView::default()
        };
        let view = PictureView { camera: stage.camera(arguments.view, now, &view), ..view };
        drawer.draw(&stage.draw(now, &view), arguments.size)
    }
}

/// Kinds of movies in one file.
const KINDS: &[FileKind] = &[FileKind::Apng, FileKind::Gif, MP4, GLB];
const MP4: FileKind = FileKind::Other { title: "MP4 movie", endings: &["mp4"], begin: b"\0\0\0" };
const GLB: FileKind = FileKind::Other { title: "glTF model", endings: &["glb"], begin: b"glTF" };

/// Kind of the movie's file; none for a folder of pictures.
fn kind_of(out: &Path) -> Option<FileKind> {
    FileKind::of(out, KINDS).filter(|_| !out.is_dir())
}

fn check_target(out: &Path) -> Result<(), Failure> {
    check_folder(out)?;
    if std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some()) {
        return Err(format!("\"{}\" is not empty; choose an empty or new folder", out.display()).into());
    }
    let kind = kind_of(out);
    if kind == Some(MP4) {
        Ffmpeg::find()?;
    }
    kind.map_or(Ok(()), |kind| check_replaced(out, kind))
}

/// Takes a picture and its number.
type AddPicture<'a> = &'a mut dyn FnMut(usize, &Picture) -> Result<(), Failure>;

/// Writes the pictures that `draw` adds; what is not finished leaves nothing.
fn write(
    arguments: &MovieArguments,
    pictures: usize,
    draw: impl FnOnce(AddPicture<'_>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let (out, stop) = (&arguments.out, stop_flag()?);
    let go_on = || if stop.load(Ordering::Relaxed) { Err("stopped; nothing was written") } else { Ok(()) };
    let finished = match kind_of(out) {
        Some(MP4) => {
            let file = NewFile::create(out, MP4).map_err(|cause| cannot(out, &cause))?;
            let mut ffmpeg = Ffmpeg::start(file.unfinished(), arguments)?;
            draw(&mut |_, picture| {
                go_on()?;
                ffmpeg.add(picture)
            })?;
            ffmpeg.finish()?;
            file.finish()
        }
        Some(kind) => {
            let format = if kind == FileKind::Gif { MovieFormat::Gif } else { MovieFormat::Apng };
            let mut file = NewFile::create(out, kind).map_err(|cause| cannot(out, &cause))?;
            let mut movie = MovieWriter::new(&mut file, format, arguments.size, pictures as u32, arguments.fps)?;
            draw(&mut |_, picture| {
                go_on()?;
                Ok(movie.add(picture)?)
            })?;
            movie.finish()?;
            file.finish()
        }
        None => {
            let folder = NewFolder::create(out).map_err(|cause| cannot(out, &cause))?;
            draw(&mut |number, picture| {
                go_on()?;
                let path = folder.unfinished().join(format!("frame_{:05}.png", number + 1));
                std::fs::write(&path, picture.to_png()?).map_err(|cause| cannot(&path, &cause))
            })?;
            folder.finish()
        }
    };
    finished.map_err(|cause| cannot(out, &cause))?;
    note(&format!("{pictures} pictures"));
    say(out.display())
}

/// The encoder of MP4 files, another program, which reads pictures from its input.
struct Ffmpeg(Child);

impl Ffmpeg {
    /// Fails with what to do where it is not installed.
    fn find() -> Result<(), Failure> {
        let mut version = Command::new("ffmpeg");
        version.arg("-version").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        match version.status() {
            Ok(_) => Ok(()),
            Err(cause) => {
                let text = format!(
                    "cannot run ffmpeg, which writes .mp4 files: {cause}. Install it (Debian and Ubuntu: sudo apt install \
                     ffmpeg), or write .apng, .gif or .glb"
                );
                Err(text.into())
            }
        }
    }

    fn start(out: &Path, arguments: &MovieArguments) -> Result<Self, Failure> {
        let [width, height] = arguments.size;
        let (size, rate) = (format!("{width}x{height}"), arguments.fps.to_string());
        let mut command = Command::new("ffmpeg");
        command.args([
            "-loglevel",
            "error",
            "-y",
            "-f",
            "rawvideo",
            "-pix_fmt",
            "rgba",
            "-s",
            &size,
            "-r",
            &rate,
            "-i",
            "-",
        ]);
        // Players want even sides and colours at half resolution.
        command.args([
            "-vf",
            "pad=ceil(iw/2)*2:ceil(ih/2)*2",
            "-pix_fmt",
            "yuv420p",
            "-movflags",
            "+faststart",
            "-f",
            "mp4",
        ]);
        Ok(Self(command.arg(out).stdin(Stdio::piped()).stdout(Stdio::null()).spawn()?))
    }

    fn add(&mut self, picture: &Picture) -> Result<(), Failure> {
        let input = self.0.stdin.as_mut().ok_or("ffmpeg takes no pictures")?;
        Ok(input.write_all(&picture.rgba).map_err(|cause| format!("ffmpeg takes no more pictures: {cause}"))?)
    }

    fn finish(mut self) -> Result<(), Failure> {
        drop(self.0.stdin.take());
        let status = self.0.wait()?;
        if status.success() { Ok(()) } else { Err(format!("ffmpeg failed ({status}); its message is above").into()) }
    }
}

impl Drop for Ffmpeg {
    fn drop(&mut self) {
        // Without its input it ends; what it wrote is removed with the unfinished file.
        drop(self.0.stdin.take());
        let _ended = self.0.wait();
    }
}
