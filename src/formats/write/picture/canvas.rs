use std::convert::Infallible;

use embedded_graphics::{
    Pixel,
    draw_target::DrawTarget,
    geometry::{OriginDimensions, Size},
    pixelcolor::Rgb888,
    prelude::RgbColor,
};

/// A picture in red, green and blue, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Canvas {
    /// A white one.
    pub fn white(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![[255; 3]; width * height] }
    }

    /// One whose pixels are there.
    pub fn new(width: usize, pixels: Vec<[u8; 3]>) -> Self {
        Self { width, height: pixels.len() / width, pixels }
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Three bytes a pixel.
    pub fn bytes(&self) -> &[u8] {
        self.pixels.as_flattened()
    }

    /// The pixel in column `x` of row `y`.
    #[cfg(test)]
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        self.pixels[y * self.width + x]
    }

    /// A line with smooth edges from `a` to `b`, `thickness` pixels wide.
    pub fn line(&mut self, a: [f32; 2], b: [f32; 2], thickness: f32, color: [u8; 3]) {
        let reach = thickness / 2.0 + 1.0;
        let from = |k: usize| (a[k].min(b[k]) - reach).max(0.0) as usize;
        let to = |k: usize, most: usize| ((a[k].max(b[k]) + reach).max(0.0) as usize + 1).min(most);
        let d = [b[0] - a[0], b[1] - a[1]];
        let sq_length = (d[0] * d[0] + d[1] * d[1]).max(f32::MIN_POSITIVE);
        for y in from(1)..to(1, self.height) {
            for x in from(0)..to(0, self.width) {
                let q = [x as f32 + 0.5 - a[0], y as f32 + 0.5 - a[1]];
                let along = ((q[0] * d[0] + q[1] * d[1]) / sq_length).clamp(0.0, 1.0);
                let off = (q[0] - along * d[0]).hypot(q[1] - along * d[1]);
                self.blend(x, y, color, (thickness / 2.0 + 0.5 - off).clamp(0.0, 1.0));
            }
        }
    }

    fn blend(&mut self, x: usize, y: usize, color: [u8; 3], share: f32) {
        let pixel = &mut self.pixels[y * self.width + x];
        for (old, new) in pixel.iter_mut().zip(color) {
            *old = (f32::from(*old) + share * (f32::from(new) - f32::from(*old))).round() as u8;
        }
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.width as u32, self.height as u32)
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I>(&mut self, pixels: I) -> Result<(), Infallible>
    where
        I: IntoIterator<Item = Pixel<Rgb888>>,
    {
        for Pixel(place, color) in pixels {
            let (x, y) = (usize::try_from(place.x), usize::try_from(place.y));
            if let (Ok(x), Ok(y)) = (x, y)
                && x < self.width
                && y < self.height
            {
                self.pixels[y * self.width + x] = [color.r(), color.g(), color.b()];
            }
        }
        Ok(())
    }
}
