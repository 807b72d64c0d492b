use std::{fs, io, path::Path};

use serde_json::{Value, json};

use super::Cloud;

/// Writes `NAME.ply` (binary little-endian, float64 x y z, int32 label) and `NAME.json`, the truth.
pub fn write(directory: &Path, cloud: &Cloud) -> io::Result<()> {
    fs::create_dir_all(directory)?;
    fs::write(directory.join(format!("{}.ply", cloud.name)), ply(cloud))?;
    let text = serde_json::to_string_pretty(&truth(cloud)).map_err(io::Error::other)?;
    fs::write(directory.join(format!("{}.json", cloud.name)), text)
}

/// The labelled points as PLY.
pub fn ply(cloud: &Cloud) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\n\
         property double y\nproperty double z\nproperty int label\nend_header\n",
        cloud.points.len()
    )
    .into_bytes();
    for (p, label) in cloud.points.iter().zip(&cloud.labels) {
        p.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend(label.to_le_bytes());
    }
    bytes
}

/// Every surface's type, parameters and coefficients, and the noise.
pub fn truth(cloud: &Cloud) -> Value {
    let surface = |(label, s): (usize, &super::TrueSurface)| {
        let mut value = json!({
            "label": label,
            "points": s.points,
            "type": s.surface.surface_type().name(),
            "coefficients": s.surface.quadric().map(|q| q.scaled().0.0),
        });
        if let (Value::Object(all), Ok(Value::Object(parameters))) =
            (&mut value, serde_json::to_value(s.surface))
        {
            all.extend(parameters);
        }
        value
    };
    json!({
        "name": cloud.name,
        "unit": "mm",
        "points": cloud.points.len(),
        "noise_sigma": cloud.sigma,
        "surfaces": cloud.surfaces.iter().enumerate().map(surface).collect::<Vec<_>>(),
    })
}
