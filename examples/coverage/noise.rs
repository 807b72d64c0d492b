//! What lies between points and the truth.

use std::f64::consts::TAU;

use conicoid::geometry::Vec3;

use crate::draw::RADIUS;
use crate::random::Random;

/// Kinds of noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Noise {
    /// Independent.
    White,
    /// Half of the variance goes together over some length.
    Correlated,
    /// Three lobes.
    Lobed,
    /// Rounded coordinates.
    Stepped,
}

/// Length over which correlated noise goes together, in radii.
const TOGETHER: f64 = 0.15;
/// Waves of a field: so many that its sums over a surface are nearly normal too.
const WAVES: usize = 200;
/// Lobes, and their amplitude in standard deviations of the noise.
const LOBES: (f64, f64) = (3.0, 5.0);
/// Steps of coordinates, in standard deviations of the noise.
pub const STEP: f64 = 2.0;

impl Noise {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::White, Self::Correlated, Self::Lobed, Self::Stepped];

    /// The name.
    pub fn name(self) -> &'static str {
        match self {
            Self::White => "white",
            Self::Correlated => "correlated",
            Self::Lobed => "lobed",
            Self::Stepped => "stepped",
        }
    }

    /// The noise of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|noise| noise.name() == name)
    }
}

/// A place of a feature, what angle a lobe sees it at, how much of the lobes is there, and the normals along which noise is.
pub struct Place {
    pub at: Vec3,
    pub angle: f64,
    pub lobes: f64,
    pub normals: Vec<Vec3>,
}

/// The noise of one draw.
pub struct Drawn {
    noise: Noise,
    sigma: f64,
    phase: f64,
    fields: Vec<Vec<(Vec3, f64)>>,
}

impl Drawn {
    /// Of standard deviation `sigma`.
    pub fn new(noise: Noise, sigma: f64, random: &mut Random) -> Self {
        let fields = if noise == Noise::Correlated { 2 } else { 0 };
        let length = TOGETHER * RADIUS;
        let mut field =
            |_| (0..WAVES).map(|_| (random.normals() / length, random.uniform(0.0, TAU))).collect();
        let fields = (0..fields).map(&mut field).collect();
        Self { noise, sigma, phase: random.uniform(0.0, TAU), fields }
    }

    /// A point beside `place`.
    pub fn point(&self, place: &Place, random: &mut Random) -> Vec3 {
        let mut at = place.at;
        for (k, normal) in place.normals.iter().enumerate() {
            let white = random.normal();
            let height = match self.noise {
                Noise::Correlated => 0.5_f64.sqrt() * (white + self.field(k, &place.at)),
                Noise::Lobed if k == 0 => {
                    white + LOBES.1 * place.lobes * (LOBES.0 * place.angle + self.phase).cos()
                }
                _ => white,
            };
            at += normal * (self.sigma * height);
        }
        at
    }

    fn field(&self, k: usize, at: &Vec3) -> f64 {
        let sum: f64 =
            self.fields[k].iter().map(|(wave, phase)| (wave.dot(at) + phase).cos()).sum();
        sum * (2.0 / WAVES as f64).sqrt()
    }
}
