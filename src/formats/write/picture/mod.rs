//! A segmented cloud as a picture: what a mail or a ticket shows of a result.
//!
//! 1. the camera looks from the front, the right and above, without perspective, so that one scale holds everywhere;
//! 2. each point is a small disc on its surface, the nearest disc wins each pixel, and holes between discs are closed;
//! 3. pixels are lit by the surface's normal, and lines part one region from the next;
//! 4. ids, axes and a scale bar are drawn on top.
//!
//! The same cloud gives the same bytes on any number of threads.

mod camera;
mod canvas;
mod furniture;
mod holes;
mod scene;
mod shade;
mod spacing;
mod splats;

use std::io::{self, Write};

use camera::Camera;
use canvas::Canvas;

pub use scene::Scene;

/// Width of a picture in pixels.
const WIDTH: usize = 1280;
/// Height of a picture in pixels.
const HEIGHT: usize = 960;
/// Each pixel is the mean of so many squared: edges are smooth.
const FINER: usize = 2;

/// Memory that a picture takes while it is drawn, in bytes: eight for each fine pixel, three for each pixel.
pub const PICTURE_BYTES: u64 = (WIDTH * HEIGHT * (8 * FINER * FINER + 3)) as u64;

/// Draws `scene` and writes it as a PNG file of 1280 x 960 pixels.
///
/// An empty scene is a white picture.
///
/// # Errors
/// `out` fails.
pub fn write_picture(out: &mut impl Write, scene: &Scene) -> io::Result<()> {
    let canvas = draw(scene);
    let mut encoder = png::Encoder::new(out, WIDTH as u32, HEIGHT as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(canvas.bytes())?;
    Ok(writer.finish()?)
}

fn draw(scene: &Scene) -> Canvas {
    let Some(camera) = Camera::on(scene, WIDTH, HEIGHT) else {
        return Canvas::white(WIDTH, HEIGHT);
    };
    let fine = camera.finer(FINER);
    let winners = splats::draw(scene, &fine, WIDTH * FINER, HEIGHT * FINER);
    holes::close(scene, &winners);
    let mut canvas = shade::shaded(scene, &fine, &winners, FINER);
    furniture::captions(&mut canvas, scene, &winners, FINER);
    furniture::axes(&mut canvas, &camera);
    furniture::scale_bar(&mut canvas, &camera);
    canvas
}

#[cfg(test)]
mod tests;
