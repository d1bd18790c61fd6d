//! tour

pub mod cli;
