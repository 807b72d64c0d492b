/// The colour (red, green, blue) of a region's points; grey for -1.
///
/// Hues step by the golden angle, so that regions with near ids look different; lightness and chroma change from
/// one to the next as well, for there are fewer hues that differ than regions. All are made in OKLCH (Ottosson
/// 2020), where equal numbers look equally light, so that none stands out that means no more than another.
pub fn region_color(label: i32) -> [u8; 3] {
    const LIGHTNESS: [f64; 3] = [0.68, 0.57, 0.78];
    const CHROMA: [f64; 2] = [0.14, 0.10];
    /// The first is a blue.
    const FIRST: f64 = 250.0;
    const GOLDEN_ANGLE: f64 = 137.507_764_050_037_85;
    if label < 0 {
        return [128; 3];
    }
    let hue = (FIRST + f64::from(label) * GOLDEN_ANGLE).to_radians();
    let lightness = LIGHTNESS[(label % 3) as usize];
    let chroma = CHROMA[(label / 12 % 2) as usize];
    srgb(lightness, chroma * hue.cos(), chroma * hue.sin())
}

/// A colour of OKLAB as sRGB; what lies outside is cut off.
fn srgb(lightness: f64, a: f64, b: f64) -> [u8; 3] {
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701 * s,
    ]
    .map(|linear| {
        let linear: f64 = linear.clamp(0.0, 1.0);
        let coded = match linear {
            small if small <= 0.003_130_8 => 12.92 * small,
            large => 1.055 * large.powf(1.0 / 2.4) - 0.055,
        };
        (coded * 255.0).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_and_white_are_where_oklab_has_them() {
        assert_eq!(srgb(1.0, 0.0, 0.0), [255; 3]);
        // the published values of pure red
        let red = srgb(0.627_955_4, 0.224_863_1, 0.125_846_3);
        assert!(red[0] >= 254 && red[1] <= 3 && red[2] <= 3, "{red:?}");
    }

    #[test]
    fn regions_have_colours_of_their_own() {
        assert_eq!(region_color(-1), [128; 3]);
        let colours: Vec<_> = (0..72).map(region_color).collect();
        let apart = |a: &[u8; 3], b: &[u8; 3]| -> i32 {
            a.iter().zip(b).map(|(a, b)| (i32::from(*a) - i32::from(*b)).abs()).sum()
        };
        for (k, a) in colours.iter().enumerate() {
            assert!(apart(a, &[128; 3]) > 40, "{k} is grey");
            assert!(colours[..k].iter().all(|b| a != b), "{k} comes twice");
            assert!(colours[k.saturating_sub(3)..k].iter().all(|b| apart(a, b) > 40), "{k}");
        }
    }
}
