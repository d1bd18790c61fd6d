//! Experiments as functions: data in, tables out, no window. Each can be run from the command line.

mod physics_cost;

pub use physics_cost::{BenchScene, CostRow, bench_scenes, physics_cost};
