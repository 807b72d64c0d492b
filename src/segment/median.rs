//! The middle of some values.

/// The median, of two middle ones the larger; `None` of no values. Leaves them in another order.
pub fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Standard deviation of normal residuals from the median of their absolute values; `None` of none.
pub fn deviation(residuals: impl Iterator<Item = f64>) -> Option<f64> {
    let mut absolute: Vec<f64> = residuals.map(f64::abs).collect();
    median(&mut absolute).map(|m| 1.4826 * m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_value_and_there_is_none_of_nothing() {
        assert_eq!(median(&mut [3.0, -1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [4.0, 1.0]), Some(4.0));
        assert_eq!(median(&mut []), None);
        assert_eq!(deviation([-2.0, 1.0, 3.0].into_iter()), Some(2.0 * 1.4826));
        assert_eq!(deviation(std::iter::empty()), None);
    }
}
