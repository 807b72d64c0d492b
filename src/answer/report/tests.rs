use super::*;
use std::sync::Arc;

use crate::{
    answer::{Form, Request, Timing, sha256},
    formats::{self, Limits},
    segment::{Silent, segment},
};

/// A ball of radius 10 about (0, 0, 10) on a plate of 40 x 40, as text.
fn ball_on_a_plate() -> String {
    let mut text = String::new();
    let place = |k: usize, step: f64| (k as f64 * step).fract();
    for k in 0..4000 {
        let z: f64 = 2.0 * place(k, 0.618_033_988_7) - 1.0;
        let turn = std::f64::consts::TAU * place(k, 0.414_213_562_3);
        let r = (1.0 - z * z).sqrt() * 10.0;
        let off = 1.0 + 0.002 * (place(k, 0.732_050_807_6) - 0.5);
        let (x, y, z) = (r * turn.cos() * off, r * turn.sin() * off, 10.0 + 10.0 * z * off);
        text += &format!("{x:.5} {y:.5} {z:.5}\n");
        let (x, y) =
            (40.0 * place(k, 0.618_033_988_7) - 20.0, 40.0 * place(k, 0.414_213_562_3) - 20.0);
        text += &format!("{x:.5} {y:.5} {:.5}\n", 0.02 * (place(k, 0.732_050_807_6) - 0.5));
    }
    text
}

fn answer(name: &str) -> Answer {
    let request = Request::from_pairs([("name", name), ("min_points", "77")]).unwrap();
    found_in(&ball_on_a_plate(), &request)
}

fn found_in(text: &str, request: &Request) -> Answer {
    let cloud = formats::read(text.as_bytes(), None, &Limits::default()).unwrap();
    let found = segment(&cloud, &request.parameters, &Silent).unwrap();
    let source = (sha256(text.as_bytes()), "xyz");
    Answer::new(Arc::new(cloud), found, request, source, Timing::default())
}

fn written(name: &str) -> (Answer, String) {
    let answer = answer(name);
    let html = Form::Html.write(answer.clone(), true).unwrap();
    (answer, String::from_utf8(html).unwrap())
}

#[test]
fn a_report_tells_every_surface_parameter_and_where_it_comes_from() {
    let (answer, html) = written("ball.xyz");
    let document = &answer.document;
    assert_eq!(document.regions.len(), 2);
    for region in &document.regions {
        assert!(html.contains(&format!("id=\"region-{}\"", region.id)));
        assert!(html.contains(&count(region.point_count)));
    }
    for told in [
        "ball.xyz",
        "sphere",
        "plane",
        &document.input.sha256,
        &document.conicoid,
        "min points",
        "77",
        &super::super::sheet::number(document.parameters.tolerance.unwrap()),
        &super::super::sheet::number(document.parameters.noise_sigma.unwrap()),
    ] {
        assert!(html.contains(told), "{told}");
    }
    // the sphere's diameter is 20, with as many digits as it is known to
    let at = html.find("diameter</span> ").unwrap() + "diameter</span> ".len();
    let (value, sd) = html[at..].split_once('<').unwrap().0.split_once(" ± ").unwrap();
    let (value, sd): (f64, f64) = (value.parse().unwrap(), sd.parse().unwrap());
    assert!((value - 20.0).abs() < 4.0 * sd && sd < 0.01, "{value} {sd}");
}

#[test]
fn a_report_is_one_file_that_loads_nothing_and_has_no_script() {
    let (_, html) = written("ball.xyz");
    for foreign in ["http://", "https://", "<script", "<link", "url(", "@import", "javascript:"] {
        assert!(!html.contains(foreign), "{foreign}");
    }
    let sources: Vec<_> = html.split("src=\"").skip(1).collect();
    assert!(sources.len() == 1 && sources[0].starts_with("data:image/png;base64,"));
    let picture = sources[0].split(['"', ',']).nth(1).unwrap();
    assert!(BASE64_STANDARD.decode(picture).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn a_report_of_the_same_input_is_the_same_file() {
    assert!(written("a").1 == written("a").1);
}

#[test]
fn a_name_is_text_and_nothing_else() {
    let (_, html) = written("<img src=x onerror=alert(1)>&.ply");
    assert!(html.contains("&lt;img src=x onerror=alert(1)&gt;&amp;.ply"));
    assert!(!html.contains("<img src=x"));
}

#[test]
fn every_point_of_a_region_stands_in_its_histogram() {
    let answer = answer("ball.xyz");
    let document = &answer.document;
    let told = histograms(&answer);
    for (region, histogram) in document.regions.iter().zip(&told) {
        assert_eq!(histogram.bars.iter().sum::<u32>() as usize, region.point_count);
        // even noise from -0.01 to 0.01: nothing beyond, and as much on either side
        let half = histogram.bars.len() / 2;
        let (below, above) = (&histogram.bars[..half], &histogram.bars[half + 1..]);
        let sums = [below, above].map(|bars| f64::from(bars.iter().sum::<u32>()));
        assert!((sums[0] / sums[1] - 1.0).abs() < 0.1, "{sums:?}");
        assert!(histogram.mean().abs() < 0.1 * region.fit.rms);
    }
}

#[test]
fn a_cloud_without_surfaces_has_a_report_too() {
    let mut text = String::new();
    let mut state = 1_u64;
    // the minimal standard generator
    let mut random = || {
        state = state * 48_271 % 2_147_483_647;
        10.0 * state as f64 / 2_147_483_647.0
    };
    for _ in 0..500 {
        text += &format!("{} {} {}\n", random(), random(), random());
    }
    let request = Request::default();
    let answer = found_in(&text, &request);
    assert!(answer.document.regions.is_empty());
    let html = String::from_utf8(Form::Html.write(answer, true).unwrap()).unwrap();
    assert!(html.contains("None was found") && html.contains("Point cloud"));
}
