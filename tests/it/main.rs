//! The service as its callers see it: over HTTP, over gRPC and on the command line.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test fails by panicking"
)]

mod architecture;
mod bad_input;
mod contract;
mod joints;
mod parameters;
mod properties;
mod same_answer;
mod service;
mod support;
