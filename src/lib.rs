//! conicoid finds the quadric surfaces in a 3D point cloud.
//!
//! The map: [`geometry`] holds values, [`formats`] turns bytes into clouds and results into bytes,
//! [`fit`] fits surfaces, [`segment`] is the whole method, [`model`] derives from its regions what CAD systems
//! need. [`jobs`] runs segmentations on a pool,
//! [`service`] is the use cases, [`http`] and [`grpc`] are the transports, [`cli`] is the command line.
//! Imports point one way, in that order, and no files import each other in a circle; the first five are
//! synchronous and silent (no clock, no threads of their own, no environment).

pub mod cli;
pub mod fit;
pub mod formats;
pub mod geometry;
pub mod grpc;
pub mod http;
pub mod jobs;
pub mod model;
pub mod segment;
pub mod service;
