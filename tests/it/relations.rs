//! Relations of regions against those of the true surfaces.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{FRAC_PI_2, TAU};

use conicoid::{
    geometry::{PointCloud, Surface, SurfaceType, Vec3},
    model::relations::{MeasureKind, Relation, RelationKind as Kind, Relations},
    segment::{Parameters, Region, Segmentation, Silent, segment},
};

use super::support::{
    related::{KINDS, deviation, direction, pairs, truth},
    truth::{Cloud, Patch, Random, cad, cloud::moved_surface},
};

fn run(cloud: &Cloud) -> Segmentation {
    segment(&cloud.input(), &Parameters::default(), &Silent).unwrap()
}

fn told(regions: &[Region]) -> Vec<Relation> {
    Relations::of(regions).told().0
}

/// The true surface of each region whose points are nearly all on it and whose type it has.
fn true_surfaces(cloud: &Cloud, found: &Segmentation) -> Vec<Option<Surface>> {
    let mut common: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    let mut size = vec![0; found.regions.len()];
    for (&truth, &label) in cloud.labels.iter().zip(&found.labels) {
        if let (Ok(t), Ok(l)) = (usize::try_from(truth), usize::try_from(label)) {
            *common.entry((l, t)).or_default() += 1;
        }
        if let Ok(l) = usize::try_from(label) {
            size[l] += 1;
        }
    }
    let mut out = vec![None; found.regions.len()];
    for ((l, t), n) in common {
        let surface = cloud.surfaces[t].surface;
        let same_type = surface.surface_type() == found.regions[l].surface_type;
        if same_type && n as f64 > 0.9 * size[l] as f64 {
            out[l] = Some(surface);
        }
    }
    out
}

/// How many relations of pairs are found, missed and made up.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    found: usize,
    missed: usize,
    false_ones: usize,
}

fn compare(cloud: &Cloud, counts: &mut BTreeMap<Kind, Count>) {
    let found = run(cloud);
    let surfaces = true_surfaces(cloud, &found);
    let accepted = told(&found.regions);
    let claimed: BTreeSet<(Kind, [usize; 2])> = accepted
        .iter()
        .filter(|r| r.accepted)
        .flat_map(|r| pairs(r).into_iter().map(|p| (r.kind, p)))
        .collect();
    for b in 0..surfaces.len() {
        for a in 0..b {
            let (Some(s), Some(t)) = (&surfaces[a], &surfaces[b]) else { continue };
            let touching = found.regions[a].neighbours.iter().any(|n| n.region == b);
            let true_ones = truth(s, t, touching);
            for kind in KINDS {
                // two balls are on one axis only by what has that axis
                if kind == Kind::Coaxial && direction(s).is_none() && direction(t).is_none() {
                    continue;
                }
                let count = counts.entry(kind).or_default();
                match (true_ones.contains(&kind), claimed.contains(&(kind, [a, b]))) {
                    (true, true) => count.found += 1,
                    (true, false) => count.missed += 1,
                    (false, true) => count.false_ones += 1,
                    (false, false) => {}
                }
            }
        }
    }
}

#[test]
fn relations_of_machined_parts_are_those_of_their_true_surfaces() {
    let mut counts = BTreeMap::new();
    for (name, points, sigma) in [
        ("bracket", 60_000, 0.01),
        ("flange", 60_000, 0.02),
        ("shaft", 60_000, 0.01),
        ("housing", 120_000, 0.02),
        ("tee", 80_000, 0.05),
        ("lever", 50_000, 0.01),
        ("mould", 80_000, 0.0),
        ("cover", 80_000, 0.01),
        ("clevis", 50_000, 0.02),
    ] {
        for seed in 11..13 {
            compare(&cad::make(name, seed, points, sigma, true).unwrap(), &mut counts);
        }
    }
    let (mut found, mut missed, mut false_ones) = (0, 0, 0);
    for (kind, count) in &counts {
        let Count { found: f, missed: m, false_ones: x } = *count;
        assert!(100 * x <= f, "{kind:?}: {count:?}");
        (found, missed, false_ones) = (found + f, missed + m, false_ones + x);
    }
    assert!(found > 5000, "{counts:?}");
    assert!(100 * missed <= found && 100 * false_ones <= found, "{counts:?}");
}

#[test]
fn a_part_that_was_made_less_exactly_than_it_is_measured_keeps_its_relations() {
    for (name, points, made) in [("bracket", 60_000, 0.01), ("housing", 120_000, 0.004)] {
        let found = run(&cad::make(name, 2, points, 0.01, true).unwrap());
        let exact = Relations::of(&found.regions);
        assert_eq!(exact.scatter, 0.0, "{name}");
        let exact = exact.told().0;
        let random = &mut Random::new(8);
        let mut regions = found.regions;
        for region in &mut regions {
            let extent = region.extent.unwrap();
            let [low, high] = [extent.min, extent.max].map(Vec3::from);
            let middle = (low + high) / 2.0;
            let turn = random.normal3() * (2.0 * made / (high - low).norm());
            let rotation = nalgebra::Rotation3::new(turn);
            let shift = middle - rotation * middle + made * random.normal3();
            region.surface = region.surface.map(|s| moved_surface(&s, &rotation, &shift));
        }
        let relations = Relations::of(&regions);
        assert!(relations.scatter > made / 3.0 && relations.scatter < 3.0 * made, "{name}");
        let kept = |all: &[Relation]| -> usize {
            let directed = |r: &&Relation| matches!(r.kind, Kind::Parallel | Kind::Perpendicular);
            all.iter().filter(directed).map(|r| pairs(r).len()).sum()
        };
        let (before, after) = (kept(&exact), kept(&relations.told().0));
        assert!(after * 10 > before * 9, "{name}: {after} of {before}");
    }
}

/// Planes, cylinders and balls with nothing in common, apart from each other.
fn unrelated(seed: u64) -> Cloud {
    let random = &mut Random::new(seed);
    let mut patches = Vec::new();
    for k in 0..18 {
        let at = 100.0 * Vec3::new((k % 3) as f64, (k / 3 % 3) as f64, (k / 9) as f64);
        let at = at + Vec3::from_fn(|_, _| random.uniform(-10.0, 10.0));
        let rotation = random.rotation();
        let (length, radius) = (random.uniform(20.0, 40.0), random.uniform(5.0, 15.0));
        patches.push(match k % 3 {
            0 => {
                let [u, v] = [rotation * Vec3::x() * length, rotation * Vec3::y() * 30.0];
                Patch::plane(at, u, v, 2000, random)
            }
            1 => {
                let axis = rotation * Vec3::z() * length;
                Patch::cylinder(at, axis, radius, [0.0, 5.0], 2000, random)
            }
            _ => Patch::sphere(at, radius, |_| true, 2000, random),
        });
    }
    Cloud::assemble("unrelated", patches, 0.02, 100, random)
}

#[test]
fn surfaces_with_nothing_in_common_have_no_relations() {
    let mut pairs = 0;
    for seed in 1..=12 {
        let found = run(&unrelated(seed));
        assert!(found.regions.len() >= 17, "{seed}: {}", found.regions.len());
        pairs += found.regions.len() * (found.regions.len() - 1) / 2;
        let relations = told(&found.regions);
        assert!(relations.is_empty(), "{seed}: {relations:?}");
    }
    assert!(pairs > 1500);
}

/// What is told of a part, without the names of its regions: kinds, how many regions, pitches and counts.
fn summary(relations: &[Relation], unit: f64) -> BTreeMap<String, usize> {
    let mut all = BTreeMap::new();
    for r in relations {
        let pitches = r.pitches.map(|p| p.map(|p| (10.0 * p / unit).round()));
        let text = format!(
            "{:?} {} {} {:?} {:?} {pitches:?}",
            r.kind,
            r.regions.len(),
            r.to.len(),
            r.count,
            r.counts
        );
        *all.entry(text).or_default() += 1;
    }
    all
}

#[test]
fn relations_stay_the_same_far_away_and_in_any_unit() {
    let part = cad::make("flange", 3, 50_000, 0.02, true).unwrap();
    let here = summary(&told(&run(&part).regions), 1.0);
    for (unit, offset) in [(1e-3, 0.0), (1e3, 0.0), (1.0, 1e6), (1e-3, 100.0)] {
        let offset = offset * Vec3::new(1.0, -2.0, 0.5);
        let points = part.points.iter().map(|p| p * unit + offset).collect();
        let cloud = PointCloud::from_points(points);
        let found = segment(&cloud, &Parameters::default(), &Silent).unwrap();
        assert_eq!(summary(&told(&found.regions), unit), here, "{unit} {offset}");
    }
}

#[test]
fn patterns_of_holes_are_told_with_their_counts_and_pitches() {
    let patterns = |name: &str, points: usize, sigma: f64| {
        let all = told(&run(&cad::make(name, 1, points, sigma, true).unwrap()).regions);
        let of = |kind: Kind| all.iter().filter(|r| r.kind == kind).cloned().collect::<Vec<_>>();
        (of(Kind::CirclePattern), of(Kind::GridPattern))
    };
    // seven holes on a circle of radius 38 about the bore
    let (circles, grids) = patterns("flange", 80_000, 0.02);
    let [circle] = &circles[..] else { panic!("{circles:?}") };
    assert_eq!((circle.count, circle.regions.len(), grids.len()), (Some(7), 7, 0));
    assert!((circle.value.unwrap() - 38.0).abs() < 0.01 && !circle.to.is_empty(), "{circle:?}");
    // seven columns and four rows, 20 apart, of holes with unlike radii
    let (circles, grids) = patterns("drilled", 150_000, 0.02);
    let [grid] = &grids[..] else { panic!("{grids:?}") };
    let mut counts = grid.counts.unwrap();
    counts.sort_unstable();
    assert_eq!((counts, circles.len()), ([4, 7], 0));
    assert!(grid.pitches.unwrap().iter().all(|p| (p - 20.0).abs() < 0.005), "{grid:?}");
    // a rectangle of 35 by 36 of counterbored holes
    let (_, grids) = patterns("bracket", 80_000, 0.01);
    let mut pitches = grids[0].pitches.unwrap();
    pitches.sort_by(f64::total_cmp);
    assert_eq!(grids[0].counts, Some([2, 2]));
    assert!((pitches[0] - 35.0).abs() < 0.01 && (pitches[1] - 36.0).abs() < 0.01, "{grids:?}");
    // a row of five with pitch 26, and of three with pitch 40
    let (_, grids) = patterns("manifold", 200_000, 0.02);
    for (count, pitch) in [(5, 26.0), (3, 40.0)] {
        let row = grids.iter().find(|g| g.counts == Some([count, 1]));
        let found = row.unwrap_or_else(|| panic!("{grids:?}")).pitches.unwrap()[0];
        assert!((found - pitch).abs() < 0.01, "{found}");
    }
}

/// How far one true surface is from the mirror image of another in the plane through `point` across `n`.
fn off_mirror(a: &Surface, b: &Surface, point: &Vec3, n: &Vec3) -> f64 {
    let image = |x: &Vec3| x - 2.0 * n * n.dot(&(x - point));
    match (a, b) {
        (Surface::Plane(a), Surface::Plane(b)) => b.normal.dot(&(image(&a.point) - b.point)).abs(),
        (Surface::Sphere(a), Surface::Sphere(b)) => {
            (image(&a.center) - b.center).norm().max((a.radius - b.radius).abs())
        }
        (Surface::Cylinder(a), Surface::Cylinder(b)) => {
            let away = b.axis_direction.cross(&(image(&a.axis_point) - b.axis_point)).norm();
            away.max((a.radius - b.radius).abs())
        }
        (Surface::Cone(a), Surface::Cone(b)) => {
            b.axis_direction.cross(&(image(&a.apex) - b.apex)).norm()
        }
        _ => f64::NAN,
    }
}

#[test]
fn mirrored_pairs_are_those_of_the_true_surfaces() {
    let mut checked = 0;
    for (name, points, sigma) in [
        ("housing", 120_000, 0.02),
        ("mould", 80_000, 0.0),
        ("tee", 80_000, 0.05),
        ("cover", 80_000, 0.01),
    ] {
        let cloud = cad::make(name, 5, points, sigma, true).unwrap();
        let found = run(&cloud);
        let surfaces = true_surfaces(&cloud, &found);
        let mirrors: Vec<_> = told(&found.regions);
        let mirrors = mirrors.iter().filter(|r| r.kind == Kind::Symmetric);
        for mirror in mirrors {
            let pairs: Vec<[Surface; 2]> = mirror
                .regions
                .chunks(2)
                .filter_map(|p| Some([surfaces[p[0]]?, surfaces[p[1]]?]))
                .collect();
            // the true mirror is the one nearest to that told across which the most pairs agree
            let told = Vec3::from(mirror.direction.unwrap());
            let directions = surfaces.iter().flatten().filter_map(direction).map(|d| d.0);
            let n = directions.max_by(|a, b| a.dot(&told).abs().total_cmp(&b.dot(&told).abs()));
            let n = n.unwrap();
            let [a, b] = pairs[0].map(|s| {
                let Surface::Plane(p) = s else { return super::support::related::place(&s) };
                p.point
            });
            let middle = (a + b) / 2.0;
            for [a, b] in &pairs {
                let off = off_mirror(a, b, &middle, &n);
                assert!(off < 1e-6, "{name}: {off} {mirror:?} {a:?} {b:?}");
                checked += 1;
            }
        }
    }
    assert!(checked > 20, "{checked}");
}

/// Size of what lies in a result.
fn size(regions: &[Region]) -> f64 {
    let extents = regions.iter().filter_map(|r| r.extent);
    let all = extents.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), e| {
        (e.min.iter().fold(low, |a, b| a.min(*b)), e.max.iter().fold(high, |a, b| a.max(*b)))
    });
    all.1 - all.0
}

#[test]
fn snapped_surfaces_hold_every_accepted_relation_and_moved_no_more_than_their_uncertainty_allows() {
    for (name, sigma) in [("housing", 0.02), ("tee", 0.05), ("manifold", 0.03), ("cover", 0.0)] {
        let cloud = cad::make(name, 21, 100_000, sigma, true).unwrap();
        let mut regions = run(&cloud).regions;
        let free = regions.clone();
        let mut relations = Relations::of(&regions);
        let snapping = relations.snap(&mut regions).unwrap();
        let (all, _) = relations.told();
        assert!(snapping.p_value > 1e-4 && snapping.freedom > 50, "{name}: {snapping:?}");
        let accepted: Vec<&Relation> = all.iter().filter(|r| r.accepted).collect();
        assert!(accepted.len() * 20 > all.len() * 19, "{name}");
        let mut held = 0;
        for relation in accepted {
            for pair in pairs(relation) {
                let [a, b] = pair.map(|r| regions[r].snapped.unwrap().surface);
                let Some(off) = deviation(relation.kind, &a, &b) else { continue };
                assert!(off < 1e-9 * size(&regions).max(1.0), "{name}: {relation:?} {off}");
                held += 1;
            }
        }
        assert!(held > 100, "{name}: {held}");
        for (region, free) in regions.iter().zip(&free) {
            let Some(snapped) = region.snapped else { continue };
            // all else stays as it is
            assert_eq!(Region { snapped: None, ..region.clone() }, *free);
            assert!(snapped.moved < 6.0 && snapped.p_value >= 1e-6, "{name}: {snapped:?}");
            assert_eq!(snapped.surface.surface_type(), region.surface_type);
            // near the points the equation is that of the surface
            if let (Some(a), Some(b)) = (snapped.local_coefficients, region.local_coefficients) {
                let square = |c: [f64; 10]| c.iter().map(|v| v * v).sum::<f64>();
                let apart = square(std::array::from_fn(|k| a[k] - b[k]));
                assert!(apart < 0.01 * square(b), "{name} {}: {a:?} {b:?}", region.id);
            }
        }
    }
}

/// A pipe of radius 20 along x, an elbow of a quarter turn about a centre 60 above, and the pipe beyond.
fn elbow(random: &mut Random) -> Cloud {
    let (radius, major, length) = (20.0, 60.0, 110.0);
    let from = Vec3::zeros();
    let corner = Vec3::new(major, 0.0, major);
    let patches = vec![
        Patch::cylinder(
            from - length * Vec3::x(),
            length * Vec3::x(),
            radius,
            [0.0, TAU],
            7000,
            random,
        ),
        Patch::cylinder(corner, length * Vec3::z(), radius, [0.0, TAU], 7000, random),
        Patch::torus(
            major * Vec3::z(),
            [-Vec3::z(), Vec3::x()],
            [major, radius],
            TAU / 4.0,
            6000,
            random,
        ),
    ];
    let cloud = Cloud::assemble("elbow", patches, 0.05, 100, random);
    cloud.moved(&random.rotation(), &Vec3::new(300.0, -200.0, 100.0))
}

#[test]
fn an_elbow_runs_into_its_pipes() {
    for seed in 1..=3 {
        let mut regions = run(&elbow(&mut Random::new(seed))).regions;
        assert_eq!(regions.len(), 3, "{seed}");
        let mut relations = Relations::of(&regions);
        relations.snap(&mut regions).unwrap();
        let (all, _) = relations.told();
        let of = |kind: Kind| all.iter().filter(move |r| r.kind == kind && r.accepted);
        assert_eq!(of(Kind::Tangent).count(), 2, "{seed}: {all:?}");
        assert!(of(Kind::EqualRadius).any(|r| r.regions.len() == 3), "{seed}: {all:?}");
        // the pipes' axes are perpendicular to the elbow's, and to each other
        assert_eq!(of(Kind::Perpendicular).count(), 3, "{seed}: {all:?}");
        let snapped: Vec<Surface> = regions.iter().map(|r| r.snapped.unwrap().surface).collect();
        let Some(Surface::Torus(ring)) = snapped.iter().find(|s| matches!(s, Surface::Torus(_)))
        else {
            panic!("{snapped:?}")
        };
        for surface in &snapped {
            let Surface::Cylinder(pipe) = surface else { continue };
            let to_axis = pipe.axis_point - ring.center;
            let arm = pipe.axis_direction.cross(&ring.axis_direction);
            assert!((to_axis.dot(&arm).abs() - ring.major_radius).abs() < 1e-9);
            assert!(to_axis.dot(&ring.axis_direction).abs() < 1e-9);
            assert!((pipe.radius - ring.minor_radius).abs() < 1e-9);
        }
    }
}

#[test]
fn a_fillets_torus_shares_the_axis_of_its_boss_and_touches_boss_and_plate() {
    let found = run(&cad::make("flange", 2, 80_000, 0.01, true).unwrap());
    let is_torus = |r: &usize| found.regions[*r].surface_type == SurfaceType::Torus;
    let all = told(&found.regions);
    assert!(all.iter().any(|r| r.kind == Kind::Coaxial && r.regions.iter().any(is_torus)));
    let touches = all.iter().filter(|r| r.kind == Kind::Tangent && r.regions.iter().any(is_torus));
    assert!(touches.count() >= 2, "{all:?}");
}

#[test]
fn distances_and_angles_are_those_of_the_true_surfaces_within_their_uncertainty() {
    let cloud = cad::make("bracket", 4, 80_000, 0.01, true).unwrap();
    let found = run(&cloud);
    let surfaces = true_surfaces(&cloud, &found);
    let (_, measures) = Relations::of(&found.regions).told();
    let (mut square, mut count) = (0.0, 0);
    for measure in &measures {
        let [Some(a), Some(b)] = measure.regions.map(|r| surfaces[r]) else { continue };
        let ((u, x), (v, y)) = (direction(&a).unwrap(), direction(&b).unwrap());
        let apart = super::support::related::place(&a) - super::support::related::place(&b);
        let truth = match measure.kind {
            MeasureKind::Distance if x => u.cross(&apart).norm(),
            MeasureKind::Distance => u.dot(&apart).abs(),
            MeasureKind::Angle => {
                let between = u.dot(&v).abs().min(1.0).acos();
                if x == y { between } else { FRAC_PI_2 - between }
            }
        };
        let off = (measure.value - truth) / measure.uncertainty;
        assert!(off.abs() < 5.0, "{measure:?} {truth}");
        square += off * off;
        count += 1;
    }
    assert!(count > 40 && (0.4..1.8).contains(&(square / f64::from(count))), "{count} {square}");
}
