use conicoid::{geometry::*, segment::*};
use std::io::Write;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let raw = std::fs::read(&args[2]).unwrap();
    let end = raw.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let pts: Vec<Vec3> = raw[end..].chunks_exact(24).map(|c| {
        let f = |k: usize| f64::from_le_bytes(c[8*k..8*k+8].try_into().unwrap());
        Vec3::new(f(0), f(1), f(2))
    }).collect();
    let cloud = PointCloud::from_points(pts);
    let t = std::time::Instant::now();
    let p = Parameters::default();
    let (shapes, labels, sigma) = distance::run(&cloud, &p).unwrap();
    eprintln!("time {:.3} sigma {sigma:.3e}", t.elapsed().as_secs_f64());
    let mut out = std::io::BufWriter::new(std::fs::File::create(&args[4]).unwrap());
    let regions: Vec<_> = shapes.iter().enumerate().map(|(i, s)| {
        let q = s.surface().unwrap().quadric().scaled().0;
        serde_json::json!({"id": i, "type": s.family.surface_type().unwrap().name(), "coefficients": q.0})
    }).collect();
    serde_json::to_writer(&mut out, &serde_json::json!({"regions": regions, "labels": labels})).unwrap();
    out.flush().unwrap();
}
