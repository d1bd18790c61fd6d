//! `palpate movie`: a stored trial, or presenter mode, as an animated picture, without a window.

use super::output::{TemporaryFolder, cannot};
use super::prelude::*;
use super::snapshot::{Drawer, OpenDrawable, open_drawable, parse_size, parse_theme, parse_view};
use crate::app::{Mode, OffscreenWindow, film_presentation};
use glam::Vec2;
use palpate_geometry::drawing::StandardView;
use palpate_geometry::palette::Theme;
use palpate_lab::inspection::OpenTrial;
use palpate_lab::picture::PictureView;
use palpate_render::{MovieFormat, MovieWriter, Picture};
use palpate_sim::scene::Scene;
use palpate_store::{NewFile, NewFolder};

/// Arguments of `palpate movie`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate movie 1 --out grasp.apng
  palpate movie 1 --view front --speed 0.25 --from 0.5 --to 1.5 --out contact.gif
  palpate movie 1 --size 1280x800 --fps 30 --out frames/

  palpate movie --demo 60 --size 1280x800 --fps 10 --out demo/

A folder gets a PNG file per picture, for any other encoder. Fingers of the real gripper are drawn as arcs of the
curvature that their strips read.")]
pub(super) struct MovieArguments {
    /// Trial number.
    #[arg(required_unless_present = "demo", conflicts_with = "demo")]
    trial: Option<TrialId>,
    /// Film so many seconds of presenter mode instead of a trial: object after object, recognised live.
    #[arg(long, value_name = "SECONDS", value_parser = within(0.1..=600.0), conflicts_with_all = ["view", "from", "to", "no_forces", "bare"])]
    demo: Option<f64>,
    /// View: hand, front, back, left, right, top or bottom.
    #[arg(long, value_name = "NAME", default_value = "hand", value_parser = parse_view)]
    view: StandardView,
    /// Width and height in pixels.
    #[arg(long, value_name = "WxH", default_value = "640x400", value_parser = parse_size)]
    size: [u32; 2],
    /// Theme: dark or light.
    #[arg(long, value_name = "NAME", default_value = "dark", value_parser = parse_theme)]
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
    /// File to write (.apng, .png or .gif), or a folder for one PNG file per picture.
    #[arg(long, value_name = "PATH", value_parser = file_or_folder(KINDS))]
    out: PathBuf,
}

/// Most pictures: ten minutes at 25 per second.
const MOST_PICTURES: f64 = 15_000.0;

pub(super) fn run(arguments: &MovieArguments, store: Option<&Path>) -> Result<(), Failure> {
    let out = &arguments.out;
    let target = Target::of(out)?;
    let Some(id) = arguments.trial else { return film(arguments, &target) };
    let store = read_store(store)?;
    let open = open_drawable(&store, id)?;
    let times = times(arguments, &open.trial)?;
    let full_scale = open.stage.full_scale_of(open.trial.frames.iter().map(AsRef::as_ref));
    let mut shot = Shot { drawer: Drawer::new()?, open: &open, full_scale, arguments };
    let stop = stop_flag()?;
    let mut writer = Writer::begin(&target, out, arguments, times.len())?;
    for (number, t_s) in times.iter().enumerate() {
        if stop.load(Ordering::Relaxed) {
            return Err("stopped; nothing was written".into());
        }
        writer.add(number, &shot.picture(*t_s)?)?;
    }
    end(writer, out, times.len())
}

/// Films presenter mode, with a store of its own.
fn film(arguments: &MovieArguments, target: &Target) -> Result<(), Failure> {
    let MovieArguments { out, size, theme, demo, .. } = arguments;
    let step_s = step_s(arguments);
    let pictures = count(demo.unwrap_or_default(), step_s)?;
    let folder = TemporaryFolder::new()?;
    let window = OffscreenWindow {
        scene: Scene::default(),
        store: folder.path().join("trials.sqlite"),
        mode: Mode::Demo,
        theme: *theme,
        size: *size,
        trial: None,
        at_s: 0.0,
    };
    let stop = stop_flag()?;
    let mut writer = Writer::begin(target, out, arguments, pictures)?;
    film_presentation(&window, pictures, step_s, |number, picture| -> Result<(), Failure> {
        if stop.load(Ordering::Relaxed) {
            return Err("stopped; nothing was written".into());
        }
        writer.add(number, picture)
    })?;
    end(writer, out, pictures)
}

fn end(writer: Writer, out: &Path, pictures: usize) -> Result<(), Failure> {
    writer.finish(out)?;
    note(&format!("{pictures} pictures"));
    say(out.display())
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
const KINDS: &[FileKind] = &[FileKind::Apng, FileKind::Gif];

/// Where pictures go.
enum Target {
    File(FileKind, MovieFormat),
    Folder,
}

impl Target {
    fn of(out: &Path) -> Result<Self, Failure> {
        check_folder(out)?;
        if std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some()) {
            return Err(format!("\"{}\" is not empty; choose an empty or new folder", out.display()).into());
        }
        let Some(kind) = FileKind::of(out, KINDS).filter(|_| !out.is_dir()) else { return Ok(Self::Folder) };
        check_replaced(out, kind)?;
        Ok(Self::File(kind, if kind == FileKind::Gif { MovieFormat::Gif } else { MovieFormat::Apng }))
    }
}

/// Writes pictures; what is not finished leaves nothing.
enum Writer {
    File { movie: MovieWriter<SharedFile>, file: SharedFile },
    Folder(NewFolder),
}

/// The file of a movie, which its encoder writes to and which gets its name at the end.
#[derive(Clone)]
struct SharedFile(std::rc::Rc<std::cell::RefCell<NewFile>>);

impl std::io::Write for SharedFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.borrow_mut().flush()
    }
}

impl Writer {
    fn begin(target: &Target, out: &Path, arguments: &MovieArguments, pictures: usize) -> Result<Self, Failure> {
        match target {
            Target::File(kind, format) => {
                let file = NewFile::create(out, *kind).map_err(|cause| cannot(out, &cause))?;
                let file = SharedFile(std::rc::Rc::new(std::cell::RefCell::new(file)));
                let movie = MovieWriter::new(file.clone(), *format, arguments.size, pictures as u32, arguments.fps)?;
                Ok(Self::File { movie, file })
            }
            Target::Folder => Ok(Self::Folder(NewFolder::create(out).map_err(|cause| cannot(out, &cause))?)),
        }
    }

    fn add(&mut self, number: usize, picture: &Picture) -> Result<(), Failure> {
        match self {
            Self::File { movie, .. } => Ok(movie.add(picture)?),
            Self::Folder(folder) => {
                let path = folder.unfinished().join(format!("frame_{:05}.png", number + 1));
                std::fs::write(&path, picture.to_png()?).map_err(|cause| cannot(&path, &cause))
            }
        }
    }

    fn finish(self, out: &Path) -> Result<(), Failure> {
        let finished = match self {
            Self::File { movie, file } => {
                movie.finish()?;
                std::rc::Rc::into_inner(file.0).ok_or("the movie is still being written")?.into_inner().finish()
            }
            Self::Folder(folder) => folder.finish(),
        };
        finished.map_err(|cause| cannot(out, &cause))
    }
}
