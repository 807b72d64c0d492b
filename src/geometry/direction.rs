use super::Vec3;

/// Components beyond this, or all below one over it, are scaled: the square of a direction's length must be neither zero nor infinite.
const FAR: f64 = 1e100;

/// The direction with components that its length can be taken of; itself where they are such, or where none is finite and not zero.
pub fn moderate(direction: [f64; 3]) -> [f64; 3] {
    let most = Vec3::from(direction).amax();
    let is_odd = most.is_finite() && most > 0.0 && !(1.0 / FAR..=FAR).contains(&most);
    if is_odd { direction.map(|x| x / most) } else { direction }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_of_any_length_has_a_unit_vector_and_keeps_it() {
        for length in [5e-324, 1e-200, 1e-100, 0.1, 1.0, 1e100, 1e160, f64::MAX] {
            let told = Vec3::from(moderate([0.0, -length, length])).normalize();
            let unit = Vec3::new(0.0, -1.0, 1.0).normalize();
            assert!((told - unit).norm() < 1e-15, "{length:e}: {told}");
        }
        assert_eq!(moderate([0.0, 3.0, 4.0]), [0.0, 3.0, 4.0]);
        assert_eq!(moderate([0.0; 3]), [0.0; 3]);
    }
}
