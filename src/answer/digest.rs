use sha2::{Digest, Sha256};

use crate::geometry::PointCloud;

/// SHA-256 of `bytes` in hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    sha256_unless(bytes, || false)
}

/// SHA-256 of `bytes`, or of some of them once `stopped` says so: then nobody looks at it.
pub fn sha256_unless(bytes: &[u8], stopped: impl Fn() -> bool) -> String {
    /// About five milliseconds' worth.
    const BLOCK: usize = 8 << 20;
    let mut hash = Sha256::new();
    bytes.chunks(BLOCK).take_while(|_| !stopped()).for_each(|block| hash.update(block));
    hexadecimal(hash)
}

/// SHA-256 of the points of a cloud that came without a file: x, y and z of each input point as little-endian float64,
/// all three NaN (0x7ff8000000000000) where one was not finite. `stopped` is as for [`sha256_unless`].
pub fn sha256_of_points(cloud: &PointCloud, stopped: impl Fn() -> bool) -> String {
    /// About a quarter of a millisecond's worth.
    const BLOCK: usize = 1 << 14;
    let hole = f64::from_bits(0x7ff8_0000_0000_0000);
    let mut hash = Sha256::new();
    let (mut bytes, mut stored) = (Vec::with_capacity(24 * BLOCK), 0);
    for first in (0..cloud.input_len).step_by(BLOCK).take_while(|_| !stopped()) {
        bytes.clear();
        for at in first..cloud.input_len.min(first + BLOCK) {
            let is_stored = match &cloud.input_index {
                Some(index) => index.get(stored).is_some_and(|&next| next as usize == at),
                None => true,
            };
            let point = cloud.points.get(stored).filter(|_| is_stored);
            let point = point.map_or([hole; 3], |p| (*p).into());
            stored += usize::from(is_stored);
            bytes.extend(point.iter().flat_map(|x| x.to_le_bytes()));
        }
        hash.update(&bytes);
    }
    hexadecimal(hash)
}

fn hexadecimal(hash: Sha256) -> String {
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn points_have_the_digest_of_their_bytes() {
        let hole = f64::from_bits(0x7ff8_0000_0000_0000);
        let points = vec![[1.0, -2.5, 3.0], [hole; 3], [0.25, 1e300, -0.0]];
        let bytes: Vec<u8> = points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let given = vec![points[0], [f64::INFINITY, 0.0, 0.0], points[2]];
        for points in [points, given] {
            let cloud = PointCloud::from_points(points.into_iter().map(Vec3::from).collect());
            assert_eq!(sha256_of_points(&cloud, || false), sha256(&bytes));
        }
    }
}
