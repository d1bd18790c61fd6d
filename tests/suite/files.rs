//! Objects and scenes from elsewhere. Sound ones of every kind are grasped; malformed ones of every kind are refused or
//! mended with a warning, and never bring the program down or make it hang.

mod foreign;
mod malformed;
