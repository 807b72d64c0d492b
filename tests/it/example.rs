//! The example of README, as a newcomer runs it.

use std::path::Path;

use serde_json::Value;

use super::support::conicoid;

/// Radii of the lever's cylinders as it was made.
const RADII: [f64; 6] =
    [18.468616192156404, 11.472364150530924, 10.468616192156404, 7.4723641505309235, 3.0, 3.0];

/// What the command line finds on the lever.
fn found(flags: &[&str]) -> Value {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("lever.json");
    let lever = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/lever.ply");
    let files = [lever.to_str().unwrap(), "-o", out.to_str().unwrap()];
    let output = conicoid(&[&files[..], flags].concat(), None);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&std::fs::read(out).unwrap()).unwrap()
}

#[test]
fn small_cones_are_found_with_any_seed_and_the_noise_given() {
    for seed in ["0", "8", "9"] {
        let found = found(&["--noise-sigma", "0.01", "--seed", seed]);
        let regions = found["regions"].as_array().unwrap();
        let cones = regions.iter().filter(|r| r["type"] == "cone").count();
        assert_eq!((regions.len(), cones), (26, 3), "seed {seed}");
    }
}

#[test]
fn the_lever_comes_with_the_radii_that_it_was_made_with() {
    let found = found(&[]);
    let regions = found["regions"].as_array().unwrap();
    assert!((24..=26).contains(&regions.len()), "{}", regions.len());
    let mut seen = Vec::new();
    for region in regions.iter().filter(|r| r["type"] == "cylinder") {
        let radius = region["surface"]["radius"].as_f64().unwrap();
        let deviation = region["uncertainty"]["radius"].as_f64().unwrap();
        let true_one =
            RADII.iter().min_by(|a, b| (*a - radius).abs().total_cmp(&(*b - radius).abs()));
        assert!((radius - true_one.unwrap()).abs() < 4.0 * deviation, "{radius} +- {deviation}");
        seen.push(*true_one.unwrap());
    }
    assert_eq!(seen.len(), 6, "{seen:?}");
    assert!((regions[0]["length"].as_f64().unwrap() - 21.0).abs() < 0.01);
}
