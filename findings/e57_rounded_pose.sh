#!/usr/bin/env bash
# A pose whose quaternion is rounded to two digits scales a whole scan in one E57 reader and not in another.
#
# Versions: pye57 0.4.19 (PyPI, with numpy 2.2.6), e57 0.11.13 (crates.io).
# Seen: a scan of two points 100 m apart, turned by 90 degrees, with the rotation written as
# (0.71, 0, 0, 0.71). pye57 writes it as it is given and brings the quaternion to length 1 when it reads:
# 100.000 m. The crate e57 rotates with the numbers as they stand, which multiplies every length by
# |q|^2 = 1.0082: 100.820 m, without an error or a warning.
# Rule: bring the quaternion of a pose to length 1 before use.
#
# Needs python3 with venv and pip, and cargo. Fails where the behaviour changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check pye57==0.4.19 numpy==2.2.6
cat > write.py <<'PY'
import numpy, pye57

file = pye57.E57("scan.e57", mode="w")
points = {"cartesianX": numpy.array([0.0, 100.0]), "cartesianY": numpy.zeros(2), "cartesianZ": numpy.zeros(2)}
file.write_scan_raw(points, rotation=numpy.array([0.71, 0.0, 0.0, 0.71]), translation=numpy.zeros(3))
file.close()
scan = pye57.E57("scan.e57").read_scan(0, ignore_missing_fields=True)
ends = numpy.array([scan["cartesian" + axis] for axis in "XYZ"])
print("%.3f" % numpy.linalg.norm(ends[:, 1] - ends[:, 0]))
PY
python=$(venv/bin/python write.py)

mkdir -p reader/src
cat > reader/Cargo.toml <<'TOML'
[package]
name = "reader"
version = "0.0.0"
edition = "2021"

[dependencies]
e57 = "=0.11.13"

[workspace]
TOML
cat > reader/src/main.rs <<'RUST'
use e57::{CartesianCoordinate, E57Reader};

fn main() {
    let mut file = E57Reader::from_file("scan.e57").unwrap();
    let scan = file.pointclouds().remove(0);
    let points = file.pointcloud_simple(&scan).unwrap();
    let ends: Vec<[f64; 3]> = points
        .map(|point| match point.unwrap().cartesian {
            CartesianCoordinate::Valid { x, y, z } => [x, y, z],
            other => panic!("{other:?}"),
        })
        .collect();
    let square = |k: usize| (ends[1][k] - ends[0][k]).powi(2);
    println!("{:.3}", (square(0) + square(1) + square(2)).sqrt());
}
RUST
rust=$(cargo run -q --manifest-path reader/Cargo.toml)

echo "distance of the two points: pye57 $python m, crate e57 $rust m"
[ "$python" = 100.000 ] && [ "$rust" = 100.820 ]
