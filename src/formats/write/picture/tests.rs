use std::f64::consts::TAU;

use super::*;
use crate::formats::region_color;
use crate::geometry::Vec3;

/// A ball of radius 10 with its upper half one region and its lower half another, on a plate below.
fn ball_on_a_plate() -> (Vec<Vec3>, Vec<i32>, Vec<[f32; 3]>) {
    let (mut points, mut labels, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..60_000 {
        let z: f64 = 2.0 * (k as f64 * 0.618_033_988_7).fract() - 1.0;
        let turn = TAU * (k as f64 * 0.414_213_562_3).fract();
        let r = (1.0 - z * z).sqrt();
        let n = Vec3::new(r * turn.cos(), r * turn.sin(), z);
        points.push(Vec3::new(1e6, -2e6, 0.0) + 10.0 * n);
        labels.push(i32::from(z < 0.0));
        normals.push([n.x as f32, n.y as f32, n.z as f32]);
    }
    for k in 0..20_000 {
        let x = 40.0 * (k as f64 * 0.618_033_988_7).fract() - 20.0;
        let y = 40.0 * (k as f64 * 0.414_213_562_3).fract() - 20.0;
        points.push(Vec3::new(1e6 + x, -2e6 + y, -10.0));
        labels.push(2);
        normals.push([0.0, 0.0, 1.0]);
    }
    (points, labels, normals)
}

fn scene<'a>(parts: &'a (Vec<Vec3>, Vec<i32>, Vec<[f32; 3]>)) -> Scene<'a> {
    Scene { points: &parts.0, labels: &parts.1, normals: &parts.2 }
}

/// How alike two colours are but for how light they are: the cosine between them less their grey.
fn likeness(a: [u8; 3], b: [u8; 3]) -> f64 {
    let chroma = |c: [u8; 3]| {
        let v = Vec3::from(c.map(f64::from));
        v - Vec3::repeat(v.mean())
    };
    let (a, b) = (chroma(a), chroma(b));
    a.dot(&b) / (a.norm() * b.norm()).max(1e-9)
}

#[test]
fn each_place_has_the_colour_of_the_surface_that_is_nearest_there() {
    let parts = ball_on_a_plate();
    let scene = scene(&parts);
    let camera = Camera::on(&scene, WIDTH, HEIGHT).unwrap();
    let canvas = draw(&scene);
    let middle = Vec3::new(1e6, -2e6, 0.0);
    let seen = |p: Vec3| {
        let (x, y, _) = camera.place(&p);
        canvas.pixel(x as usize, y as usize)
    };
    let towards = |right: f64, up: f64| {
        // the point of the ball that is seen so far from its middle
        let back = (100.0 - right * right - up * up).sqrt();
        middle + right * camera.right + up * camera.up + back * camera.back
    };
    for (right, up) in [(0.0, 3.0), (4.0, 6.0), (-8.0, 2.0), (0.0, -8.0), (5.0, -7.0), (-5.0, -7.5)]
    {
        let p = towards(right, up);
        let label = i32::from(p.z < 0.0);
        assert!(likeness(seen(p), region_color(label)) > 0.9, "{right} {up}: {:?}", seen(p));
    }
    for (x, y) in [(-18.0, -15.0), (18.0, -18.0), (18.0, 10.0)] {
        let p = middle + Vec3::new(x, y, -10.0);
        assert!(likeness(seen(p), region_color(2)) > 0.9, "{x} {y}: {:?}", seen(p));
    }
    // nothing shines through: a place of the plate behind the ball shows the ball
    let behind =
        middle - 12.0 * Vec3::new(camera.back.x, camera.back.y, 0.0) + Vec3::new(0.0, 0.0, -10.0);
    assert!(likeness(seen(behind), region_color(2)) < 0.9);
    assert_eq!(canvas.pixel(3, 3), [255; 3]);
}

#[test]
fn the_side_towards_the_lamp_is_lighter() {
    let parts = ball_on_a_plate();
    let scene = scene(&parts);
    let camera = Camera::on(&scene, WIDTH, HEIGHT).unwrap();
    let canvas = draw(&scene);
    let light = |right: f64, up: f64| {
        let back = (100.0 - right * right - up * up).sqrt();
        let p =
            Vec3::new(1e6, -2e6, 0.0) + right * camera.right + up * camera.up + back * camera.back;
        let (x, y, _) = camera.place(&p);
        canvas.pixel(x as usize, y as usize).iter().map(|c| u32::from(*c)).sum::<u32>()
    };
    assert!(light(-3.0, 6.0) > light(8.5, 2.0) + 60);
}

#[test]
fn a_picture_is_a_png_file_of_what_was_drawn() {
    let parts = ball_on_a_plate();
    let mut bytes = Vec::new();
    write_picture(&mut bytes, &scene(&parts)).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((frame.width as usize, frame.height as usize), (WIDTH, HEIGHT));
    assert_eq!(pixels, draw(&scene(&parts)).bytes());
}

#[test]
fn a_cloud_of_no_point_or_one_is_a_picture_too() {
    for n in [0, 1, 2] {
        let parts = (vec![Vec3::new(1.0, 2.0, 3.0); n], vec![-1; n], vec![[0.0; 3]; n]);
        let mut bytes = Vec::new();
        write_picture(&mut bytes, &scene(&parts)).unwrap();
        assert!(bytes.starts_with(b"\x89PNG"), "{n}");
    }
}

#[test]
fn the_scale_bar_is_as_long_as_it_says() {
    let parts = ball_on_a_plate();
    let scene = scene(&parts);
    let camera = Camera::on(&scene, WIDTH, HEIGHT).unwrap();
    let (x0, _, _) = camera.place(&Vec3::new(1e6, -2e6, 0.0));
    let (x1, _, _) = camera.place(&(Vec3::new(1e6, -2e6, 0.0) + 10.0 * camera.right));
    let canvas = draw(&scene);
    // the bar's own row: dark from one end to the other
    let y = HEIGHT - 34;
    let dark: Vec<usize> = (WIDTH / 2..WIDTH).filter(|x| canvas.pixel(*x, y)[0] < 90).collect();
    let length = (dark[dark.len() - 1] - dark[0]) as f64;
    // ten units are x1 - x0 pixels, and the bar is the longest round length within 240
    assert!((length - (x1 - x0)).abs() < 4.0, "{length} {}", x1 - x0);
}
