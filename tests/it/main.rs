//! The service as its callers see it: over HTTP, over gRPC and on the command line.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test fails by panicking"
)]

mod absence;
mod access;
mod accuracy;
mod architecture;
mod bad_input;
mod browser;
mod cancel;
mod circles;
mod coefficients;
mod constants;
mod contract;
mod deploy;
mod dimensions;
mod example;
mod features;
mod files;
mod hints;
mod jobs;
mod joints;
mod meshes;
mod parameters;
mod properties;
mod relations;
mod representations;
mod room;
mod routes;
mod same_answer;
mod service;
mod settings;
mod step;
mod storage;
mod strangers;
mod supply;
mod support;
mod survival;
mod terminal;
mod tls;
mod told;
mod traces;
mod viewer;
