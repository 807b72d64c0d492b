//! Numbers as a person reads them: with the digits that their uncertainty deserves.

/// Most decimals that are written.
const MOST_DECIMALS: i32 = 12;

/// A value with two digits of its standard deviation, such as `12.340 ± 0.012`; with five digits of its own where
/// none is known.
pub fn exact(value: f64, deviation: Option<f64>) -> String {
    match decimals(deviation) {
        Some((decimals, deviation)) => {
            format!("{} ± {deviation:.decimals$}", fixed(value, decimals))
        }
        None => number(value),
    }
}

/// A value with five significant digits.
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let power = power(value);
    if !(-5..9).contains(&power) {
        return format!("{value:.4e}");
    }
    let text = fixed(value, (4 - power).max(0) as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// A point or direction with the decimals that the largest of its standard deviations deserves; with those that its
/// largest component deserves where none is known. The deviation itself is not written.
pub fn vector(values: [f64; 3], deviation: Option<f64>) -> String {
    let largest = values.iter().fold(0.0f64, |a, v| a.max(v.abs()));
    let told = decimals(deviation).map(|(decimals, _)| decimals);
    let decimals = told.unwrap_or_else(|| {
        if largest > 0.0 { (4 - power(largest)).clamp(0, MOST_DECIMALS) as usize } else { 0 }
    });
    format!("({})", values.map(|value| fixed(value, decimals)).join(", "))
}

/// A standard deviation by itself, with two digits.
pub fn rough(deviation: f64) -> String {
    let decimals = 1 - power(deviation);
    if deviation > 0.0 && deviation.is_finite() && decimals <= 6 {
        return fixed(deviation, decimals.max(0) as usize);
    }
    format!("{deviation:.1e}")
}

/// A whole number in groups of three digits.
pub fn count(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// The decimals that show two digits of a standard deviation, and that; `None` where it is none, or nearer to zero
/// than can be shown.
fn decimals(deviation: Option<f64>) -> Option<(usize, f64)> {
    let deviation = deviation.filter(|d| *d > 0.0 && d.is_finite())?;
    let decimals = 1 - power(deviation);
    (decimals <= MOST_DECIMALS).then_some((decimals.max(0) as usize, deviation))
}

/// With that many decimals, and without a minus before zero.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

fn power(value: f64) -> i32 {
    value.abs().log10().floor() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_has_the_digits_that_its_uncertainty_deserves() {
        for (value, deviation, text) in [
            (12.340_123, Some(0.0123), "12.340 ± 0.012"),
            (12.340_123, Some(0.000_9), "12.34012 ± 0.00090"),
            (12_345.6, Some(230.0), "12346 ± 230"),
            (-0.000_01, Some(0.02), "0.000 ± 0.020"),
            (1.0 / 3.0, None, "0.33333"),
            (25.0, Some(0.0), "25"),
            (25.0, Some(f64::NAN), "25"),
            (25.0, Some(1e-17), "25"),
            (1.234_56e-9, None, "1.2346e-9"),
            (1e12, None, "1.0000e12"),
            (100.0, None, "100"),
            (0.0, None, "0"),
        ] {
            assert_eq!(exact(value, deviation), text);
        }
    }

    #[test]
    fn a_vector_has_one_number_of_decimals() {
        assert_eq!(vector([1.0, -2.5, 1000.0], None), "(1.0, -2.5, 1000.0)");
        assert_eq!(vector([1.0, -0.001, 3.25], Some(0.04)), "(1.000, -0.001, 3.250)");
        assert_eq!(vector([0.0; 3], None), "(0, 0, 0)");
    }

    #[test]
    fn a_deviation_has_two_digits() {
        let told = [0.0123, 123.4, 1.26e-5, 1.26e-9].map(rough);
        assert_eq!(told, ["0.012", "123", "0.000013", "1.3e-9"]);
    }

    #[test]
    fn counts_are_grouped() {
        let told = [0, 999, 1000, 1_234_567].map(count);
        assert_eq!(told, ["0", "999", "1,000", "1,234,567"]);
    }
}
