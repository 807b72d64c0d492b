use super::*;
use crate::{
    geometry::{PointCloud, Vec3},
    segment::{Parameters, Silent, segment},
};

/// A bore of radius 5 and length 8 from z = 1 to 9, with the plate it goes through.
fn plate_with_a_bore() -> Vec<Region> {
    let mut points = Vec::new();
    // places of an even spread, and noise from another one
    let place = |k: usize, step: f64| (k as f64 * step).fract();
    for k in 0..6000 {
        let (turn, z) =
            (std::f64::consts::TAU * place(k, 0.618_034), 1.0 + 8.0 * place(k, 0.414_214));
        let r = 5.0 + 0.01 * (place(k, 0.732_051) - 0.5);
        points.push(Vec3::new(r * turn.cos(), r * turn.sin(), z));
    }
    for k in 0..12_000 {
        let (x, y) = (30.0 * place(k, 0.618_034) - 15.0, 30.0 * place(k, 0.414_214) - 15.0);
        let z = 0.01 * (place(k, 0.732_051) - 0.5) + if k % 2 == 0 { 1.0 } else { 9.0 };
        if x.hypot(y) > 5.0 {
            points.push(Vec3::new(x, y, z));
        }
    }
    let cloud = PointCloud::from_points(points);
    segment(&cloud, &Parameters::default(), &Silent).unwrap().regions
}

fn told<'a>(all: &'a [Quantity], name: &str) -> &'a str {
    let found = all.iter().find(|quantity| quantity.name == name);
    &found.unwrap_or_else(|| panic!("no {name} in {all:?}")).text
}

/// The value and the standard deviation of `text`, which has both.
fn both(text: &str) -> (f64, f64) {
    let (value, deviation) = text.split_once(" ± ").unwrap();
    (value.parse().unwrap(), deviation.parse().unwrap())
}

#[test]
fn a_bore_is_told_by_its_diameter_and_depth_with_their_uncertainty() {
    let regions = plate_with_a_bore();
    let bore = regions.iter().find(|r| r.surface_type.name() == "cylinder").unwrap();
    let sizes = dimensions(bore);
    let (diameter, sd) = both(told(&sizes, "diameter"));
    assert!((diameter - 10.0).abs() < 4.0 * sd && sd < 0.001, "{sizes:?}");
    let (length, sd) = both(told(&sizes, "length"));
    assert!((length - 8.0).abs() < 4.0 * sd && sd < 0.01, "{sizes:?}");
    // it goes all round, and that need not be said
    assert!(sizes.iter().all(|quantity| quantity.name != "swept"), "{sizes:?}");
    let places = position(bore);
    assert!(told(&places, "axis").contains('°') && told(&places, "axis").contains(" ± "));
    assert!(told(&places, "ends").contains(" to "));
    let plate = regions.iter().find(|r| r.surface_type.name() == "plane").unwrap();
    let size = told(&dimensions(plate), "size").to_owned();
    let sides: Vec<f64> = size.split(" × ").map(|side| side.parse().unwrap()).collect();
    assert!(sides.iter().all(|side| (side - 30.0).abs() < 0.5), "{size}");
    assert_eq!((kind(plate).as_str(), unknown(plate)), ("plane", Vec::new()));
}

#[test]
fn angles_are_in_degrees_and_every_type_has_its_sizes() {
    let mut regions = plate_with_a_bore();
    let region = &mut regions[0];
    region.uncertainty = Some(serde_json::json!({
        "half_angle": 0.001, "diameters": [0.1, 0.02], "not_identifiable": ["semi_axes"]
    }));
    region.dimensions = crate::segment::Dimensions {
        full_angle: Some(std::f64::consts::FRAC_PI_3),
        diameters: Some(vec![20.0, 10.0]),
        end_radii: Some([1.5, 3.0]),
        swept_angle: Some(std::f64::consts::PI),
        share_seen: Some(0.424),
        side: Some(Side::Boss),
        ..Default::default()
    };
    let all = dimensions(region);
    assert_eq!(told(&all, "full angle"), "60.00 ± 0.11°");
    assert_eq!(told(&all, "diameters"), "20.00 ± 0.10 × 10.000 ± 0.020");
    assert_eq!(told(&all, "end diameters"), "3 to 6");
    assert_eq!((told(&all, "swept"), told(&all, "seen")), ("180°", "42 %"));
    assert!(kind(region).ends_with(", boss"));
    assert_eq!(unknown(region), ["semi axes"]);
}
