//! The accuracy that docs/accuracy.md states, on smaller clouds.

use conicoid::segment::{Parameters, Silent, segment};

use super::support::truth::{
    Cloud, Random, cad,
    score::{Score, score},
    smooth,
};

fn scored(cloud: &Cloud) -> Score {
    let found = segment(&cloud.input(), &Parameters::default(), &Silent).unwrap();
    let reported: Vec<_> = found.regions.iter().map(|r| (r.surface_type, r.coefficients)).collect();
    score(cloud, &found.labels, &reported)
}

/// Root mean square of the errors of all surfaces over the information limit.
fn rms(scores: &[Score]) -> f64 {
    let all = scores.iter().flat_map(|s| &s.efficiencies);
    (all.clone().map(|e| e * e).sum::<f64>() / all.count().max(1) as f64).sqrt()
}

/// The largest of the same.
fn most(scores: &[Score]) -> f64 {
    scores.iter().flat_map(|s| &s.efficiencies).copied().fold(0.0, f64::max)
}

/// Every surface is found once and nothing else, each with its type. `ratio` and `worst` are 0.003 and 0.02 below
/// the least of three seeds.
fn expect_all(
    what: &str,
    clouds: impl Iterator<Item = Cloud>,
    ratio: f64,
    worst: f64,
) -> Vec<Score> {
    let scores: Vec<Score> = clouds.map(|cloud| scored(&cloud)).collect();
    for (k, s) in scores.iter().enumerate() {
        let all = s.regions == s.surfaces && s.type_ok == 1.0;
        assert!(all && s.ratio > ratio && s.worst_iou > worst, "{what}, seed {}: {s}", k + 1);
    }
    scores
}

#[test]
fn every_surface_of_a_smooth_scene_is_found_with_its_type_at_the_information_limit() {
    let mut all = Vec::new();
    for (name, ratio, worst) in [
        ("chain3", 0.998, 0.968),
        ("chain3_exact", 0.996, 0.978),
        ("chain3_70db", 1.014, 0.968),
        ("wave5", 1.021, 0.967),
        ("capsule", 1.018, 0.973),
        ("scene_10k", 0.997, 0.979),
    ] {
        let clouds = (1..=3).map(|seed| smooth::make(name, seed).unwrap());
        all.extend(expect_all(name, clouds, ratio, worst));
    }
    // One is the limit where labels are perfect; 54 surfaces tell their mean square to a tenth of it.
    assert!(rms(&all) < 1.1 && most(&all) < 1.7, "{} {}", rms(&all), most(&all));
}

#[test]
fn the_same_scenes_are_found_with_few_points_and_with_many() {
    let mut all = Vec::new();
    for (kind, n, ratio, worst) in [
        ("chain3", 3_000, 0.994, 0.955),
        ("chain3", 30_000, 1.001, 0.972),
        ("scene", 20_000, 0.997, 0.978),
        ("part", 15_000, 1.001, 0.930),
        ("part", 30_000, 1.001, 0.947),
    ] {
        let clouds = (1..=3).map(|seed| smooth::sized(kind, n, seed).unwrap());
        all.extend(expect_all(&format!("{kind} of {n}"), clouds, ratio, worst));
    }
    assert!(rms(&all) < 1.08 && most(&all) < 2.1, "{} {}", rms(&all), most(&all));
}

#[test]
fn a_fifth_of_outliers_costs_nothing() {
    for seed in 1..=2 {
        let s = scored(&smooth::make("chain3_outliers", seed).unwrap());
        assert!(s.regions == 3 && s.type_ok == 1.0 && s.ratio > 0.997, "seed {seed}: {s}");
        // An outlier in so many lies on a surface by chance, as the truth says.
        assert!(s.false_points < s.oracle_false + 0.002, "seed {seed}: {s}");
    }
}

#[test]
fn where_no_quadric_is_none_is_found() {
    for name in smooth::EMPTY {
        let s = scored(&smooth::make(name, 1).unwrap());
        assert_eq!((s.regions, s.false_points), (0, 0.0), "{name}");
    }
}

/// The ratio that docs/accuracy.md says nearly all machined parts reach.
const PART: f64 = 0.97;

#[test]
fn machined_parts_are_found_with_a_tenth_of_their_points() {
    let mut all = Vec::new();
    for (name, n, sigma) in [
        ("bracket", 30_000, 0.01),
        ("pockets", 15_000, 0.01),
        ("flange", 30_000, 0.02),
        ("tee", 15_000, 0.05),
        ("lever", 15_000, 0.01),
        ("mould", 30_000, 0.0),
        ("bolt", 30_000, 0.01),
        ("cover", 15_000, 0.0),
        ("clevis", 15_000, 0.02),
    ] {
        for seed in 1..=2 {
            let s = scored(&cad::make(name, seed, n, sigma, seed == 1).unwrap());
            // docs/accuracy.md says 95 %: one surface of twenty.
            let types = 1.0 - 1.0 / s.surfaces as f64;
            assert!(s.ratio > PART && s.type_ok > types - 0.01, "{name} of {n}, seed {seed}: {s}");
            all.push(s);
        }
    }
    let mean = |of: fn(&Score) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
    assert!(mean(|s| s.ratio) > 0.99, "{}", mean(|s| s.ratio));
    assert!(mean(|s| s.type_ok) > 0.99, "{}", mean(|s| s.type_ok));
    assert!(rms(&all) < 1.13 && most(&all) < 2.75, "{} {}", rms(&all), most(&all));
}

/// Parts and scenes whose noise is not white, as `noisy` makes them: their mean ratio and the least.
fn ratios(noisy: impl Fn(Cloud, &mut Random) -> Cloud) -> (f64, f64) {
    let mut all = Vec::new();
    for seed in 1..=2 {
        let parts = [("bracket", 0.01), ("flange", 0.02), ("tee", 0.02)]
            .map(|(name, sigma)| cad::make(name, seed, 30_000, sigma, true));
        let scenes = ["chain3", "scene"].map(|kind| smooth::sized(kind, 20_000, seed));
        for cloud in parts.into_iter().chain(scenes) {
            all.push(scored(&noisy(cloud.unwrap(), &mut Random::new(seed))).ratio);
        }
    }
    let least = all.iter().copied().fold(f64::INFINITY, f64::min);
    (all.iter().sum::<f64>() / all.len() as f64, least)
}

#[test]
fn noise_that_neighbours_share_costs_next_to_nothing() {
    // as large as the white noise, and the same over some ten spacings
    let (mean, least) = ratios(|cloud, random| {
        let sigma = cloud.sigma;
        cloud.waving(sigma, 4.0, random)
    });
    assert!(mean > 0.99 && least > PART, "{mean} {least}");
}

#[test]
fn noise_that_is_all_smooth_hides_no_surface() {
    // the nearest points show none of it
    for (name, seed) in [("flange", 1), ("flange", 2), ("tee", 1), ("tee", 2)] {
        let cloud = cad::make(name, seed, 30_000, 0.0, true).unwrap();
        let s = scored(&cloud.waving(0.02, 4.0, &mut Random::new(seed)));
        assert!(s.ratio > 0.97, "{name}, seed {seed}: {s}");
    }
}

#[test]
fn faces_three_times_as_rough_as_others_are_found() {
    let (mean, least) = ratios(|cloud, random| cloud.with_rough_faces(3.0, random));
    // The oracle takes the noise to be the same all over: it is beaten.
    assert!(mean > 1.0 && least > 0.92, "{mean} {least}");
}
