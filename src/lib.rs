//! conicoid finds the quadric surfaces in a 3D point cloud.
//!
//! The map: [`geometry`] holds values, [`formats`] turns bytes into clouds and results into bytes,
//! [`fit`] fits surfaces, [`segment`] is the whole method, [`model`] derives from its regions what CAD systems
//! need, [`answer`] tells all that in documents and files. These are the library; what follows is built with the feature
//! `service`, which is on by default: `jobs` runs segmentations on a pool, `service` is the use cases, `http` and
//! `grpc` are the transports, `cli` is the command line.
//! Imports point one way, in that order, and no files import each other in a circle; the library is
//! synchronous and silent (no threads of its own, no environment; no clock below `answer`).

pub mod answer;
#[cfg(feature = "service")]
pub mod cli;
pub mod fit;
pub mod formats;
pub mod geometry;
#[cfg(feature = "service")]
pub mod grpc;
#[cfg(feature = "service")]
pub mod http;
#[cfg(feature = "service")]
pub mod jobs;
pub mod model;
pub mod segment;
#[cfg(feature = "service")]
pub mod service;
