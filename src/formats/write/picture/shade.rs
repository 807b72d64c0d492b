use rayon::prelude::*;

use super::{camera::Camera, canvas::Canvas, scene::Scene, splats::Winners};
use crate::formats::write::palette::region_color;

/// Light that comes from everywhere, and from the lamp.
const AMBIENT: f32 = 0.42;
const LAMP: f32 = 0.68;
/// Where the lamp is: right, up and backward of the camera; a unit vector.
const FROM: [f32; 3] = [-0.32, 0.48, 0.817];
/// How much of its light a pixel keeps on the line between two regions.
const LINE: f32 = 0.45;

/// The picture of `winners`: lit, with lines between regions, `finer` squared pixels to one.
pub fn shaded(scene: &Scene, camera: &Camera, winners: &Winners, finer: usize) -> Canvas {
    let width = winners.width / finer;
    let last = scene.labels.iter().copied().max().unwrap_or(-1);
    // the label -1 comes first
    let colors: Vec<[u8; 3]> = (-1..=last).map(region_color).collect();
    let color = |label: i32| colors[(label.max(-1) + 1) as usize];
    let one = |at: usize| {
        let (x, y) = (at % width * finer, at / width * finer);
        let mut sum = [0.0; 3];
        for k in 0..finer * finer {
            let fine = (y + k / finer) * winners.width + x + k % finer;
            let lit = match winners.point(fine) {
                None => [255.0; 3],
                Some(point) => {
                    let light = light(camera.turned(scene.normals[point]));
                    let light =
                        if is_on_line(scene, winners, fine, point) { light * LINE } else { light };
                    color(scene.labels[point]).map(|c| (f32::from(c) * light).min(255.0))
                }
            };
            sum.iter_mut().zip(lit).for_each(|(s, l)| *s += l);
        }
        sum.map(|s| (s / (finer * finer) as f32).round() as u8)
    };
    let rows = winners.height / finer;
    Canvas::new(width, (0..width * rows).into_par_iter().with_min_len(width).map(one).collect())
}

/// The light of a surface with that normal, in the camera's axes; either side is lit.
fn light(normal: [f32; 3]) -> f32 {
    if normal == [0.0; 3] {
        return 1.0;
    }
    let sign = if normal[2] < 0.0 { -1.0 } else { 1.0 };
    let facing: f32 = normal.iter().zip(FROM).map(|(n, f)| sign * n * f).sum();
    AMBIENT + LAMP * facing.max(0.0)
}

/// Whether another region, or the background, is beside a pixel of a region.
fn is_on_line(scene: &Scene, winners: &Winners, at: usize, point: usize) -> bool {
    let (own, x, y) = (scene.labels[point], at % winners.width, at / winners.width);
    if own < 0 {
        return false;
    }
    let beside = [
        (x > 0).then(|| at - 1),
        (x + 1 < winners.width).then(|| at + 1),
        (y > 0).then(|| at - winners.width),
        (y + 1 < winners.height).then(|| at + winners.width),
    ];
    // points without a region stand on a surface, and are no end of it
    beside.into_iter().flatten().any(|other| match winners.point(other) {
        None => true,
        Some(other) => scene.labels[other] >= 0 && scene.labels[other] != own,
    })
}
