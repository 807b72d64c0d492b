//! Where a region ends along its axis or its tube, and how exactly that is known.

use crate::fit::constant::constants;
use crate::fit::{Family, Shape};
use crate::geometry::Vec3;
use crate::segment::Continuity;
use crate::segment::report::dimensions::around::Arc;
use crate::segment::report::dimensions::crossing::{direction, height};
use crate::segment::report::dimensions::propagate::variance;
use crate::segment::report::known::{Joint, Known};

constants! {
    /// How far from the last points an end may lie that a neighbour tells, in spacings of the points: what lies between
    /// is on neither surface, or the fillet between them is too narrow to be found.
    NEAR: f64 = 4.0, Trial(4.0, 4.0);
    /// The same in standard deviations of the points' noise, which blurs the last points along the axis.
    BLURRED: f64 = 6.0, Derived("twice three standard deviations");
    /// Width of the band of points that tells a free end, in spacings.
    BAND: f64 = 3.0, Trial(3.0, 3.0);
    /// Share of a region's length, from a smooth joint on either side, within which it is this end's.
    SMOOTH: f64 = 0.25, Derived("a half would be the other end");
    /// Gaps wider than this many means beyond the logarithm of their number lie between rows: three standard deviations.
    ROWS: f64 = 4.42, Derived("Gumbel: the widest of n gaps is ln n + 0.58 of their mean, its deviation 1.28; three of these");
    /// Fewer points than this in a band tell no gap.
    LEAST: usize = 4, Trial(4.0, 4.0);
}

/// One end of a region.
#[derive(Clone, Copy, Debug)]
pub struct End {
    /// The neighbour that bounds it, and how it joins.
    pub by: Option<Joint>,
    /// Where it is: height over the shape's origin, or angle in the torus' frame.
    pub at: f64,
    /// Standard deviation of a free end, in the same unit; 0 of one that a neighbour tells.
    pub deviation: f64,
}

/// Both ends of a region, the lower one first.
pub struct Ends<'a> {
    /// All regions' surfaces.
    pub surfaces: &'a [Known],
    /// This region.
    pub id: usize,
    /// Its ends.
    pub ends: [End; 2],
}

/// What ends are told by.
pub struct Place<'a> {
    /// All regions' surfaces.
    pub surfaces: &'a [Known],
    /// Where they touch.
    pub joints: &'a [Joint],
    /// The region.
    pub id: usize,
    /// Spacing of its points.
    pub spacing: f64,
    /// Their noise.
    pub sigma: f64,
}

impl<'a> Place<'a> {
    fn shape(&self) -> &'a Shape {
        &self.surfaces[self.id].shape
    }

    /// The region's joints, each with the other region.
    fn neighbours(&self) -> impl Iterator<Item = (&'a Joint, usize)> + '_ {
        let id = self.id;
        let other = move |j: &Joint| match j.regions {
            [a, b] if a == id => Some(b),
            [a, b] if b == id => Some(a),
            _ => None,
        };
        self.joints.iter().filter_map(move |j| Some((j, other(j)?)))
    }

    /// The ends of a region along the axis of its cylinder, elliptic cylinder or cone; `heights` of all its points.
    pub fn along_axis(self, heights: &[f64]) -> Ends<'a> {
        let own = self.shape();
        let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let near = |at: f64, inward: f64| {
            let crossings = self.neighbours().filter_map(|(joint, other)| {
                let other = &self.surfaces[other].shape;
                let t = height(own, other, joint.continuity, at)?;
                // An inclined plane cuts the surface on either side of where it cuts the axis.
                let sloping = if other.family == Family::Plane {
                    own.w().cross(&other.w()).norm() / own.w().dot(&other.w()).abs()
                } else {
                    0.0
                };
                let reach = self.reach(joint, high - low) + sloping * own.max_radius();
                ((t - at).abs() <= reach).then_some((*joint, t))
            });
            let nearest = crossings.min_by(|a, b| (a.1 - at).abs().total_cmp(&(b.1 - at).abs()));
            match nearest {
                Some((joint, t)) => End { by: Some(joint), at: t, deviation: 0.0 },
                None => self.free(at, inward, heights.iter().map(|t| (t - at) * inward)),
            }
        };
        let ends = [near(low, 1.0), near(high, -1.0)];
        Ends { surfaces: self.surfaces, id: self.id, ends }
    }

    /// The ends of a torus' arc; `angles` of its points about its axis, in the frame of its shape. None where it closes.
    pub fn along_tube(self, angles: &mut [f64]) -> Option<Ends<'a>> {
        let own = self.shape();
        let major = own.size[0];
        // Points of a whole ring leave gaps of about their spacing.
        let arc = Arc::of(angles, (NEAR.get() * self.spacing / major).min(0.5));
        if arc.closes() {
            return None;
        }
        let near = |angle: f64, inward: f64| {
            let at = radial(own, angle);
            let crossings = self.neighbours().filter_map(|(joint, other)| {
                let e = direction(own, &self.surfaces[other].shape, &at)?;
                let off = turn(own, &at, &e);
                (off.abs() * major <= self.reach(joint, arc.angle * major)).then_some((*joint, off))
            });
            match crossings.min_by(|a, b| a.1.abs().total_cmp(&b.1.abs())) {
                Some((joint, off)) => End { by: Some(joint), at: angle + off, deviation: 0.0 },
                None => {
                    let inside = |a: &f64| {
                        let on = (a - arc.from).rem_euclid(std::f64::consts::TAU);
                        major * if inward > 0.0 { on } else { arc.angle - on }
                    };
                    let end = self.free(major * angle, inward, angles.iter().map(inside));
                    End { at: end.at / major, deviation: end.deviation / major, ..end }
                }
            }
        };
        let ends = [near(arc.from, 1.0), near(arc.from + arc.angle, -1.0)];
        Some(Ends { surfaces: self.surfaces, id: self.id, ends })
    }

    /// How far from the last points a region of that `length` may end at a joint. Over a smooth one some points may have
    /// the other label far beyond it, and where two surfaces run into each other is then no question.
    fn reach(&self, joint: &Joint, length: f64) -> f64 {
        let near = (NEAR.get() * self.spacing).max(joint.resolution) + BLURRED.get() * self.sigma;
        if joint.continuity == Continuity::G1 { near.max(SMOOTH.get() * length) } else { near }
    }

    /// A free end beyond the last point `at`; `inside` is how far each point lies inward of that. Points that come one by
    /// one leave their mean gap beyond the last; of those in rows the edge lies anywhere within the gap to a next row.
    fn free(&self, at: f64, inward: f64, inside: impl Iterator<Item = f64>) -> End {
        let mut band: Vec<f64> = inside.filter(|d| *d <= BAND.get() * self.spacing).collect();
        band.sort_unstable_by(f64::total_cmp);
        let n = band.len();
        let widest = band.windows(2).map(|p| p[1] - p[0]).fold(0.0, f64::max);
        let gap = if n < LEAST.get() { self.spacing } else { widest };
        let mean = band.last().copied().unwrap_or(0.0) / n.max(1) as f64;
        // The widest of n gaps between points that come one by one is ln n + 0.58 of their mean, give or take 1.3.
        let one_by_one = n >= LEAST.get() && gap < mean * ((n as f64).ln() + ROWS.get());
        let beyond = if one_by_one { mean } else { gap / 2.0 };
        // Noise moves the last of many points outward.
        End { by: None, at: at - inward * beyond, deviation: (gap / 2.0).hypot(self.sigma) }
    }
}

/// The unit vector from a torus' axis at an angle in the frame of its shape.
pub fn radial(torus: &Shape, angle: f64) -> Vec3 {
    torus.frame * Vec3::new(angle.cos(), angle.sin(), 0.0)
}

/// Angle about a torus' axis from `a` to `b`, in -pi..=pi.
fn turn(torus: &Shape, a: &Vec3, b: &Vec3) -> f64 {
    a.cross(b).dot(&torus.w()).atan2(a.dot(b))
}

impl Ends<'_> {
    fn shape(&self) -> &Shape {
        &self.surfaces[self.id].shape
    }

    /// Length for each unit of an end's place.
    fn unit(shape: &Shape) -> f64 {
        if shape.family == Family::Torus { shape.size[0] } else { 1.0 }
    }

    /// Distance between the ends: along the axis, or along a torus' tube.
    pub fn length(&self) -> f64 {
        (self.ends[1].at - self.ends[0].at) * Self::unit(self.shape())
    }

    /// Variance of a value told by the region's shape and by its ends, as neighbours tell these.
    fn variance(&self, value: impl Fn(&Shape, [f64; 2]) -> f64) -> Option<f64> {
        let mut surfaces = vec![&self.surfaces[self.id]];
        let mut told: [Option<(usize, Joint)>; 2] = [None; 2];
        for ((end, by), told) in self.ends.iter().zip(self.bounded_by()).zip(&mut told) {
            *told = end.by.map(|joint| (surfaces.len(), joint));
            surfaces.extend(by.map(|id| &self.surfaces[id]));
        }
        variance(&surfaces, |shapes| {
            let mut at = self.ends.map(|e| e.at);
            for (at, told) in at.iter_mut().zip(&told) {
                let Some((k, joint)) = told else { continue };
                let (own, other) = (&shapes[0], &shapes[*k]);
                if own.family == Family::Torus {
                    let e = radial(own, *at);
                    *at += turn(own, &e, &direction(own, other, &e)?);
                } else {
                    *at = height(own, other, joint.continuity, *at)?;
                }
            }
            Some(value(&shapes[0], at))
        })
    }

    /// Standard deviation of each end, along the axis or the tube.
    pub fn each(&self) -> Option<[f64; 2]> {
        let unit = Self::unit(self.shape());
        let one = |k: usize| {
            let told = self.variance(|_, at| at[k])?;
            Some(unit * (told + self.ends[k].deviation.powi(2)).sqrt())
        };
        Some([one(0)?, one(1)?])
    }

    /// Variance of the difference of the ends' places that comes from free ones.
    fn free(&self) -> f64 {
        self.ends.iter().map(|e| e.deviation.powi(2)).sum()
    }

    /// Standard deviation of the length.
    pub fn of_length(&self) -> Option<f64> {
        let told = self.variance(|own, at| (at[1] - at[0]) * Self::unit(own))?;
        Some((told + self.free() * Self::unit(self.shape()).powi(2)).sqrt())
    }

    /// Standard deviation of the angle between a torus' ends.
    pub fn of_angle(&self) -> Option<f64> {
        Some((self.variance(|_, at| at[1] - at[0])? + self.free()).sqrt())
    }

    /// The region beyond each end.
    pub fn bounded_by(&self) -> [Option<usize>; 2] {
        self.ends.map(|end| {
            let [a, b] = end.by?.regions;
            Some(if a == self.id { b } else { a })
        })
    }
}
