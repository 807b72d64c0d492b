//! What a person knows of a cloud, put in place among what was found.
//!
//! A hint is one more hypothesis, made where it says and with the families and sizes that it allows. It competes for points
//! with the surfaces around it, is joined with those that are the same, and is fitted and reported like any other. Where
//! the points deny it the answer stays theirs, and says so.

pub mod apply;
pub mod crop;
mod draft;
pub mod extend;
#[cfg(test)]
mod fixtures;
pub mod local;
mod merge;
pub mod place;
pub mod split;
pub mod surface;
mod told;

pub use draft::Draft;
