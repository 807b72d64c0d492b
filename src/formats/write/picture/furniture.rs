use embedded_graphics::{
    Drawable,
    geometry::Point,
    mono_font::{MonoFont, MonoTextStyle, ascii::FONT_9X15_BOLD},
    pixelcolor::Rgb888,
    text::{Alignment, Baseline, Text, TextStyleBuilder},
};

use super::{camera::Camera, canvas::Canvas, scene::Scene, splats::Winners};

const INK: [u8; 3] = [29, 35, 48];
/// Those of x, y and z, as CAD programs have them.
const AXES: [(&str, [u8; 3]); 3] =
    [("x", [196, 50, 42]), ("y", [31, 138, 61]), ("z", [38, 93, 196])];
/// Where the axes meet, from the left and from below, and how long they are, in pixels.
const ORIGIN: [f32; 2] = [64.0, 56.0];
const AXIS: f32 = 40.0;
/// The scale bar's end, from the right and from below, and its longest length, in pixels.
const BAR_END: [f32; 2] = [36.0, 34.0];
const LONGEST_BAR: f64 = 240.0;
/// A region has its id where it takes at least this many pixels.
const LEAST_AREA: usize = 500;
const FONT: &MonoFont = &FONT_9X15_BOLD;

/// The axes of x, y and z, at the bottom left.
pub fn axes(canvas: &mut Canvas, camera: &Camera) {
    let origin = [ORIGIN[0], canvas.height() as f32 - ORIGIN[1]];
    let mut axes = [0, 1, 2].map(|k| {
        let turned = camera.turned([0, 1, 2].map(|j| f32::from(u8::from(j == k))));
        (turned, AXES[k])
    });
    // the one that points away first
    axes.sort_by(|a, b| a.0[2].total_cmp(&b.0[2]));
    for (turned, (name, color)) in axes {
        let at = |length: f32| [origin[0] + length * turned[0], origin[1] - length * turned[1]];
        canvas.line(origin, at(AXIS), 2.5, color);
        write(canvas, name, at(AXIS + 12.0), color);
    }
}

/// A bar of a round length, at the bottom right.
pub fn scale_bar(canvas: &mut Canvas, camera: &Camera) {
    let length = round_length(LONGEST_BAR / camera.scale);
    let (right, y) = (canvas.width() as f32 - BAR_END[0], canvas.height() as f32 - BAR_END[1]);
    let left = right - (length * camera.scale) as f32;
    canvas.line([left, y], [right, y], 2.0, INK);
    for x in [left, right] {
        canvas.line([x, y - 6.0], [x, y + 6.0], 2.0, INK);
    }
    write(canvas, &length.to_string(), [(left + right) / 2.0, y - 14.0], INK);
}

/// The largest of 1, 2 and 5 times a power of ten that is no longer than `most` > 0.
fn round_length(most: f64) -> f64 {
    let power = most.log10().floor() as i32;
    // read as a decimal, so that it is written as one
    let round = |digit: u8| format!("{digit}e{power}").parse().unwrap_or(most);
    [5, 2].into_iter().map(round).find(|length| *length <= most).unwrap_or_else(|| round(1))
}

/// The id of each region that has room for it, on its visible points.
pub fn captions(canvas: &mut Canvas, scene: &Scene, winners: &Winners, finer: usize) {
    let regions = scene.labels.iter().copied().max().map_or(0, |last| (last + 1) as usize);
    let seen = || {
        (0..winners.width * winners.height).filter_map(|at| {
            let label = usize::try_from(scene.labels[winners.point(at)?]).ok()?;
            Some((label, (at % winners.width) as i64, (at / winners.width) as i64))
        })
    };
    let mut sums = vec![(0, 0, 0); regions];
    for (label, x, y) in seen() {
        let (n, sx, sy) = &mut sums[label];
        (*n, *sx, *sy) = (*n + 1, *sx + x, *sy + y);
    }
    // the visible pixel nearest to the middle of all
    let mut nearest = vec![(i64::MAX, 0, 0); regions];
    for (label, x, y) in seen() {
        let (n, sx, sy) = sums[label];
        let off = (x - sx / n).pow(2) + (y - sy / n).pow(2);
        if off < nearest[label].0 {
            nearest[label] = (off, x, y);
        }
    }
    let mut ids: Vec<usize> = (0..regions).collect();
    ids.retain(|id| sums[*id].0 as usize >= LEAST_AREA * finer * finer);
    ids.sort_by_key(|id| (std::cmp::Reverse(sums[*id].0), *id));
    let mut taken: Vec<[f32; 2]> = Vec::new();
    for id in ids {
        let (_, x, y) = nearest[id];
        let place = [x, y].map(|c| c as f32 / finer as f32);
        let is_free = |other: &[f32; 2]| {
            (place[0] - other[0]).abs() > 26.0 || (place[1] - other[1]).abs() > 17.0
        };
        if taken.iter().all(is_free) {
            taken.push(place);
            write(canvas, &id.to_string(), place, INK);
        }
    }
}

/// Text about a place, with a white rim that keeps it readable on any colour.
fn write(canvas: &mut Canvas, text: &str, place: [f32; 2], color: [u8; 3]) {
    let style =
        TextStyleBuilder::new().alignment(Alignment::Center).baseline(Baseline::Middle).build();
    let middle = Point::new(place[0].round() as i32, place[1].round() as i32);
    let mut put = |offset: Point, [r, g, b]: [u8; 3]| {
        let font = MonoTextStyle::new(FONT, Rgb888::new(r, g, b));
        let text = Text::with_text_style(text, middle + offset, font, style);
        // a canvas takes everything
        let _ = text.draw(canvas);
    };
    for y in -2..=2 {
        for x in -2..=2 {
            put(Point::new(x, y), [255; 3]);
        }
    }
    put(Point::zero(), color);
}

#[cfg(test)]
mod tests {
    use super::round_length;

    #[test]
    fn a_bar_has_a_round_length() {
        for (most, length) in [
            (1.0, "1"),
            (1.99, "1"),
            (2.0, "2"),
            (4.9, "2"),
            (0.3, "0.2"),
            (0.07, "0.05"),
            (73.0, "50"),
            (1e-7, "0.0000001"),
            (30_000.0, "20000"),
        ] {
            assert_eq!(round_length(most).to_string(), length, "{most}");
        }
    }
}
