use crate::geometry::{PointCloud, SurfaceType, Vec3};
use crate::segment::hints::fixtures::{edge, found};
use crate::segment::{
    Extent, Hint, HintAction, Outcome, Parameters, Segmentation, Silent, segment,
};

#[test]
fn points_beside_those_that_surfaces_are_looked_for_on_follow_them() {
    // above 50,000 points surfaces are looked for on a part of them
    let points = edge(60_000);
    let direction = Hint {
        at: vec![[-5.0, 5.0, 0.0]],
        axis_direction: Some([0.0, 0.0, 1.0]),
        ..Hint::default()
    };
    let split = Hint {
        action: HintAction::Split,
        at: vec![[0.0, 2.0, -5.0], [0.0, 8.0, -5.0]],
        ..Hint::default()
    };
    let found = found(&points, &[direction, split]);
    assert!(found.hints.iter().all(|h| h.outcome == Outcome::Applied), "{:?}", found.hints);
    assert_eq!(found.regions.len(), 3);
    let [flat, near, far] =
        [found.hints[0].regions[0], found.hints[1].regions[0], found.hints[1].regions[1]];
    let label = |p: &Vec3| match (p.x < -0.1, p.z < -0.1) {
        (true, _) => Some(flat),
        (_, true) if (p.y - 5.0).abs() > 1.0 => {
            Some(if (p.y < 5.0) == is_low(&found, near) { near } else { far })
        }
        _ => None,
    };
    let wrong = points
        .iter()
        .zip(&found.labels)
        .filter(|(p, l)| label(p).is_some_and(|own| usize::try_from(**l) != Ok(own)));
    assert!(wrong.clone().count() < 60, "{}", wrong.count());
}

/// Whether a region's middle lies below y = 5.
fn is_low(found: &Segmentation, region: usize) -> bool {
    let extent = found.regions[region].extent.unwrap();
    extent.min[1] + extent.max[1] < 10.0
}

#[test]
fn a_box_crops_and_what_lies_outside_says_so() {
    let points = edge(4000);
    let extent = Extent { min: [-20.0, 0.0, -0.1], max: [-1.0, 10.0, 0.1] };
    let crop = Hint { action: HintAction::Crop, extent: Some(extent), ..Hint::default() };
    let found = found(&points, &[crop]);
    let inside = points.iter().filter(|p| p.x <= -1.0 && p.z.abs() <= 0.1).count();
    assert_eq!((found.regions.len(), found.unassigned.reasons["outside"]), (1, 4000 - inside));
    assert_eq!(found.unassigned.count, 4000 - inside);
    for (p, l) in points.iter().zip(&found.labels) {
        assert_eq!(*l >= 0, p.x <= -1.0 && p.z.abs() <= 0.1);
    }
    assert_eq!(found.hints[0].outcome, Outcome::Applied);
}

#[test]
fn the_labels_of_an_earlier_result_are_places() {
    let points = edge(4000);
    let labels: Vec<i32> = points.iter().map(|p| i32::from(p.x > -0.1)).collect();
    let cloud =
        PointCloud { labels: Some(labels.clone()), ..PointCloud::from_points(points.clone()) };
    let run = |hint: Hint| {
        let parameters = Parameters { hints: vec![hint], ..Parameters::default() };
        segment(&cloud, &parameters, &Silent).unwrap()
    };
    let crop = run(Hint { action: HintAction::Crop, labels: vec![1], ..Hint::default() });
    assert_eq!(crop.regions.len(), 1);
    assert!(crop.labels.iter().zip(&labels).all(|(l, own)| (*l >= 0) <= (*own == 1)));
    let told = run(Hint {
        labels: vec![0],
        surface_type: Some(SurfaceType::Plane),
        axis_direction: Some([0.0, 0.0, 1.0]),
        ..Hint::default()
    });
    assert_eq!(
        (told.regions.len(), told.hints[0].outcome),
        (2, Outcome::Applied),
        "{:?}",
        told.hints
    );
    // without the column there is nothing to go by
    let hint = Hint { labels: vec![0], surface_type: Some(SurfaceType::Plane), ..Hint::default() };
    assert_eq!(found(&points, &[hint]).hints[0].outcome, Outcome::NotFound);
}
