//! What each stage learns from: prepared sequences, with what earlier stages and earlier grasps say laid beside them.

use super::super::Pmf;
use super::calibrated::Material;
use super::training::{Lesson, Lessons};
use rand::{Rng, RngExt};

/// Sequences side by side with their answers, and how they are varied while learning.
#[derive(Clone, Debug, Default)]
pub(super) struct Book {
    /// Inputs per step.
    pub(super) width: usize,
    /// `[steps][width]` of each grasp.
    pub(super) pages: Vec<Vec<f32>>,
    /// True class in each group.
    pub(super) targets: Vec<Vec<usize>>,
    /// For each input the one that takes its place when left and right are exchanged; none to leave sides alone.
    pub(super) mirror: Option<Vec<usize>>,
    /// How many of the inputs are readings, to which noise is added; the others are probabilities.
    pub(super) readings: usize,
    /// Deviation of the noise.
    pub(super) noise: f32,
    /// What earlier grasps of the same object may have said; none where nothing is fed back.
    pub(super) earlier: Option<Earlier>,
}

/// What grasps that were held back say of their objects, to be fed back as if they had come before.
#[derive(Clone, Debug)]
pub(super) struct Earlier {
    /// Each grasp's PMF by itself.
    pub(super) alone: Vec<Pmf>,
    /// For each grasp the others of the same class.
    pub(super) same: Vec<Vec<usize>>,
    /// Number of classes.
    pub(super) classes: usize,
}

/// Earlier grasps that are fed back at most while learning.
const MOST_EARLIER: usize = 3;

impl Earlier {
    /// What up to three other grasps of the same object say together; after none, nothing is known.
    fn draw(&self, k: usize, random: &mut dyn Rng) -> Pmf {
        let mut before = Pmf::uniform(self.classes);
        if !self.same[k].is_empty() {
            for _ in 0..random.random_range(0..=MOST_EARLIER) {
                let other = self.same[k][random.random_range(0..self.same[k].len())];
                before = before.times(&self.alone[other]);
            }
        }
        before
    }
}

impl Lessons for Book {
    fn count(&self) -> usize {
        self.pages.len()
    }

    fn draw(&self, k: usize, random: &mut dyn Rng, lesson: &mut Lesson) {
        lesson.targets.clone_from(&self.targets[k]);
        let page = &self.pages[k];
        lesson.x.clear();
        match self.mirror.as_ref().filter(|_| random.random::<bool>()) {
            Some(mirror) => {
                for row in page.chunks_exact(self.width) {
                    lesson.x.extend(mirror.iter().map(|from| row[*from]));
                }
            }
            None => lesson.x.extend_from_slice(page),
        }
        if self.noise > 0.0 {
            for row in lesson.x.chunks_exact_mut(self.width) {
                row[..self.readings].iter_mut().for_each(|x| *x += self.noise * nearly_normal(random));
            }
        }
        lesson.log_prior.clear();
        if let Some(earlier) = &self.earlier {
            let before = earlier.draw(k, random);
            lesson.log_prior.extend(before.logarithms().map(|l| l as f32));
            write_before(&mut lesson.x, self.width, &before);
        }
    }
}

/// Writes a PMF into the last inputs of every step.
pub(super) fn write_before(x: &mut [f32], width: usize, before: &Pmf) {
    for row in x.chunks_exact_mut(width) {
        let from = width - before.classes();
        row[from..].iter_mut().zip(before.probabilities()).for_each(|(x, p)| *x = *p as f32);
    }
}

/// Sum of three even numbers, of deviation one: near enough to a normal one, and bounded.
fn nearly_normal(random: &mut dyn Rng) -> f32 {
    let mut even = || random.random::<f32>();
    2.0 * (even() + even() + even() - 1.5)
}

impl Material for Book {
    fn inputs(&self, k: usize) -> &[f32] {
        &self.pages[k]
    }

    fn targets(&self, k: usize) -> &[usize] {
        &self.targets[k]
    }
}
