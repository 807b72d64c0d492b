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
mod compressed;
mod constants;
mod contract;
mod deploy;
mod dimensions;
mod example;
mod features;
mod files;
mod fleet;
mod fleet_login;
mod generators;
mod hints;
mod jobs;
mod joints;
mod listing;
mod meshes;
mod metrology;
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
mod streams;
mod supply;
mod support;
mod survival;
mod terminal;
mod thin;
mod tls;
mod told;
mod traces;
mod viewer;
