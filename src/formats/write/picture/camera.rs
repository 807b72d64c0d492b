use super::scene::Scene;
use crate::geometry::Vec3;

/// Margins around the cloud, in pixels: at the sides and above; below, where axes and scale bar stand.
const MARGIN: f64 = 36.0;
const MARGIN_BELOW: f64 = 96.0;
/// Where the camera stands: about z from the x axis, and above the plane of x and y, in radians. As the viewer's.
const YAW: f64 = -1.0;
const PITCH: f64 = 0.5;

/// A camera without perspective, with z upwards.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Unit direction to the right of the picture.
    pub right: Vec3,
    /// Unit direction upwards in the picture.
    pub up: Vec3,
    /// Unit direction towards who looks.
    pub back: Vec3,
    /// Pixels for each unit of length.
    pub scale: f64,
    /// The point that `offset` is the place of.
    pub target: Vec3,
    /// Its place in pixels, from the top left corner.
    pub offset: [f64; 2],
    /// Nearest and farthest depth of the cloud along `back` from the target.
    pub depths: [f64; 2],
}

impl Camera {
    /// The camera that has the regions of `scene` in a picture of that size, or all points where there are no
    /// regions; `None` where there are no points.
    pub fn on(scene: &Scene, width: usize, height: usize) -> Option<Self> {
        let (sy, cy) = YAW.sin_cos();
        let (sp, cp) = PITCH.sin_cos();
        let right = Vec3::new(-sy, cy, 0.0);
        let up = Vec3::new(-sp * cy, -sp * sy, cp);
        let back = Vec3::new(cp * cy, cp * sy, sp);
        let is_found = scene.labels.iter().any(|label| *label >= 0);
        let shown = scene.points.iter().zip(scene.labels);
        let shown = shown.filter(|(_, label)| !is_found || **label >= 0).map(|(p, _)| p);
        let target = *scene.points.first()?;
        let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for p in shown {
            for (end, axis) in ends.iter_mut().zip([&right, &up, &back]) {
                let along = axis.dot(&(p - target));
                *end = [end[0].min(along), end[1].max(along)];
            }
        }
        let [across, upwards, depths] = ends;
        let room = [width as f64 - 2.0 * MARGIN, height as f64 - MARGIN - MARGIN_BELOW];
        let size = [across[1] - across[0], upwards[1] - upwards[0]];
        let scale = (room[0] / size[0]).min(room[1] / size[1]);
        // one point has no size
        let scale = if scale.is_finite() { scale } else { 1.0 };
        let middle = [(across[0] + across[1]) / 2.0, (upwards[0] + upwards[1]) / 2.0];
        let place = [width as f64 / 2.0, MARGIN + room[1] / 2.0];
        let offset = [place[0] - scale * middle[0], place[1] + scale * middle[1]];
        Some(Self { right, up, back, scale, target, offset, depths })
    }

    /// The same for a picture with so many times the pixels along each side.
    pub fn finer(&self, times: usize) -> Self {
        let times = times as f64;
        Self { scale: self.scale * times, offset: self.offset.map(|o| o * times), ..*self }
    }

    /// Where a point is: pixels from the left and from the top, and depth from 0 (nearest) to 1.
    pub fn place(&self, p: &Vec3) -> (f64, f64, f64) {
        let q = p - self.target;
        let [low, high] = self.depths;
        let depth =
            ((high - self.back.dot(&q)) / (high - low).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let x = self.offset[0] + self.scale * self.right.dot(&q);
        (x, self.offset[1] - self.scale * self.up.dot(&q), depth)
    }

    /// A direction in the camera's own axes: right, up, backward.
    pub fn turned(&self, direction: [f32; 3]) -> [f32; 3] {
        let d = Vec3::from(direction.map(f64::from));
        [self.right.dot(&d) as f32, self.up.dot(&d) as f32, self.back.dot(&d) as f32]
    }
}
