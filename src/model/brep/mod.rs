//! A boundary representation: faces on exact surfaces, edges where two meet, vertices where three do.

pub mod arc;
pub mod bound;
pub mod build;
pub mod chain;
pub mod chart;
pub mod closing;
pub mod corner;
pub mod curve;
pub mod edge;
pub mod face;
pub mod form;
pub mod free;
pub mod gap;
pub mod joint;
pub mod measure;
pub mod mend;
pub mod near;
pub mod outline;
pub mod part;
pub mod settle;
pub mod sheet;
pub mod shell;
pub mod smooth;

use crate::fit::constant::Table;

/// The numbers that are decided with, by file.
pub(super) static TABLES: &[Table] = &[
    arc::CONSTANTS,
    bound::CONSTANTS,
    closing::CONSTANTS,
    corner::CONSTANTS,
    curve::CONSTANTS,
    edge::CONSTANTS,
    form::CONSTANTS,
    free::CONSTANTS,
    gap::CONSTANTS,
    joint::CONSTANTS,
    measure::CONSTANTS,
    mend::CONSTANTS,
    outline::CONSTANTS,
    part::CONSTANTS,
    settle::CONSTANTS,
    smooth::CONSTANTS,
];
