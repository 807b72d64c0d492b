//! How far the uncertainties of fits of single features can be trusted: draws of points with a known truth, each fitted,
//! and the errors set beside the uncertainties that the fits tell.
//!
//! `cargo run --release --no-default-features --example coverage [-- KEY=VALUE,VALUE ...]` prints one row a cell, then
//! figures pooled by type and noise (of cells in which at least twenty draws told), and the cells outside the targets by
//! more than chance (two standard errors).
//! Keys, each with any of its values: `type` (names of types), `arc` (degrees), `sigma` (noise over the radius), `n`
//! (points), `noise` (`white`, `correlated`, `lobed`, `stepped`), `sampling` (`even`, `scan`), `draws`, `seed`.
//!
//! Noise is along the normals: `white`; `correlated`, half of its variance white and half a smooth field that goes together
//! over 0.15 of the radius; `lobed`, white with three lobes of five times its size; `stepped`, white with all coordinates
//! rounded to steps of twice its size. The arc of a sphere or an ellipsoid is the opening angle of a cap; planes and lines
//! have none. Each draw is turned and moved at random.
//!
//! Columns, for sizes, position and direction: the share of draws in which it was told, the share of those in which the
//! truth lay within the expanded uncertainty, and the root mean square error over that of the standard uncertainty.

mod arguments;
mod draw;
mod noise;
mod random;
mod score;
mod table;

use std::process::ExitCode;

use arguments::Arguments;
use rayon::prelude::*;
use score::Score;
use table::Table;

fn main() -> ExitCode {
    let arguments = match Arguments::read(std::env::args().skip(1)) {
        Ok(arguments) => arguments,
        Err(problem) => {
            eprintln!("{problem}");
            return ExitCode::FAILURE;
        }
    };
    let mut table = Table::default();
    table::head();
    for cell in arguments.cells() {
        let first = cell.seed(arguments.seed);
        let one = |draw: u64| cell.drawn(first.wrapping_add(draw));
        let scores: Vec<Score> = (0..arguments.draws).into_par_iter().map(one).collect();
        table.add(&cell, &scores);
    }
    table.print();
    ExitCode::SUCCESS
}
