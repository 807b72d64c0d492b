//! What relations ask of surfaces, as equations.

use crate::fit::{Family, Shape};
use crate::geometry::Vec3;

/// A size of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Slot {
    /// Place of the face.
    pub face: usize,
    /// Place of the size in [`Shape::size`].
    pub size: usize,
}

/// Equations between the surfaces of some faces, all zero where they hold. Faces are named by their places.
#[derive(Clone, Debug, PartialEq)]
pub enum Constraint {
    /// The directions of both are parallel (2 equations).
    Parallel([usize; 2]),
    /// They are perpendicular (1).
    Perpendicular([usize; 2]),
    /// The second's axis, or its centre, lies on the first's axis, if they are parallel (2).
    OnAxis([usize; 2]),
    /// The second plane lies in the first, if they are parallel (1).
    InPlane([usize; 2]),
    /// Centres are one (3).
    Concentric([usize; 2]),
    /// Sizes are equal (1).
    Equal([Slot; 2]),
    /// They touch along a line (1; 3 of an elbow and a pipe): in the section across what they share, curves touch.
    Tangent {
        /// The faces.
        faces: [usize; 2],
        /// The section in which they are curves.
        section: Section,
        /// Whether two circles touch from outside.
        outside: bool,
    },
    /// Axes or centres lie on a circle about the first's axis direction: `at` gives each its multiple of the angle `step`;
    /// the first two say where (2 for each further).
    Circle {
        /// The faces.
        faces: Vec<usize>,
        /// Which multiple each is.
        at: Vec<i32>,
        /// The angle of one step, in radians.
        step: f64,
        /// Whether the last of `faces` stands in the middle.
        centred: bool,
    },
    /// Axes or centres lie on a grid: `at` gives each its two places. The first lies at (0, 0), the second at (m, 0) and,
    /// in a grid of more than one row, the third at (0, n) (2 for each further, 1 for the right angle).
    Grid {
        /// The faces.
        faces: Vec<usize>,
        /// Their places.
        at: Vec<[i32; 2]>,
    },
    /// The middle planes of two pairs are one, along the direction of `along` (1 where both pairs are planes; 2 more for
    /// each pair that is none: what they differ by is along that direction).
    Mirror {
        /// The face whose direction is across the mirror.
        along: usize,
        /// The pairs, two of one face where it lies in the mirror.
        pairs: [[usize; 2]; 2],
    },
}

/// A plane in which surfaces are curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Section {
    /// Across their common direction: planes along it are lines, cylinders circles.
    Across,
    /// Through their common axis: planes across it, cylinders and cones are lines, tori and spheres circles.
    Through,
    /// Through a torus' middle line, into which a cylinder's axis runs.
    Elbow,
}

impl Constraint {
    /// The faces it binds.
    pub fn faces(&self) -> Vec<usize> {
        let mut all = match self {
            Self::Parallel(f) | Self::Perpendicular(f) | Self::OnAxis(f) => f.to_vec(),
            Self::InPlane(f) | Self::Concentric(f) => f.to_vec(),
            Self::Equal(slots) => slots.map(|s| s.face).to_vec(),
            Self::Tangent { faces, .. } => faces.to_vec(),
            Self::Circle { faces, .. } | Self::Grid { faces, .. } => faces.clone(),
            Self::Mirror { along, pairs } => [&[*along][..], pairs.as_flattened()].concat(),
        };
        all.sort_unstable();
        all.dedup();
        all
    }

    /// How far each equation is from holding for the shapes that `of` gives.
    pub fn residuals(&self, of: &dyn Fn(usize) -> Shape) -> Vec<f64> {
        match self {
            Self::Parallel([a, b]) => across(&of(*a), &of(*b).w()),
            Self::Perpendicular([a, b]) => vec![of(*a).w().dot(&of(*b).w())],
            Self::OnAxis([a, b]) => {
                let a = of(*a);
                across(&a, &(of(*b).origin - a.origin))
            }
            Self::InPlane([a, b]) => {
                let a = of(*a);
                vec![a.w().dot(&(of(*b).origin - a.origin))]
            }
            Self::Concentric([a, b]) => (of(*b).origin - of(*a).origin).iter().copied().collect(),
            Self::Equal([a, b]) => {
                let size = |s: &Slot| of(s.face).size[s.size];
                vec![size(b).abs() - size(a).abs()]
            }
            Self::Tangent { faces: [a, b], section, outside } => {
                let (a, b) = (of(*a), of(*b));
                let gap = touch(&a, &b, *section, *outside);
                if *section == Section::Elbow { elbow(&a, &b, gap) } else { vec![gap] }
            }
            Self::Circle { faces, at, step, centred } => circle(faces, at, *step, *centred, of),
            Self::Grid { faces, at } => grid(faces, at, of),
            Self::Mirror { along, pairs } => mirror(&of(*along), pairs, of),
        }
    }
}

/// The components of `v` along the first two columns of a shape's frame.
fn across(shape: &Shape, v: &Vec3) -> Vec<f64> {
    vec![shape.frame.column(0).dot(v), shape.frame.column(1).dot(v)]
}

/// A curve of a section.
#[derive(Clone, Copy, Debug)]
enum Curve {
    /// Its unit normal and distance from the origin along that.
    Line([f64; 2], f64),
    /// Its middle and radius.
    Circle([f64; 2], f64),
}

/// Beside the distance of their axes: how far a pipe's axis is from the plane of a ring, and their radii from each other.
fn elbow(a: &Shape, b: &Shape, gap: f64) -> Vec<f64> {
    let (pipe, ring) = if a.family == Family::Torus { (b, a) } else { (a, b) };
    let height = ring.w().dot(&(pipe.origin - ring.origin));
    vec![gap, height, pipe.size[0] - ring.size[1]]
}

/// How far two surfaces are from touching: negative where they cross.
pub fn touch(a: &Shape, b: &Shape, section: Section, outside: bool) -> f64 {
    if section == Section::Elbow {
        let (pipe, ring) = if a.family == Family::Torus { (b, a) } else { (a, b) };
        let from = pipe.origin - ring.origin;
        // distance of the axes, which are perpendicular
        let arm = pipe.w().cross(&ring.w());
        return from.dot(&arm).abs() / arm.norm().max(1e-300) - ring.size[0];
    }
    let curves = [curve(a, a, b, section), curve(b, a, b, section)];
    match curves {
        [Curve::Line(n, d), Curve::Circle(c, r)] | [Curve::Circle(c, r), Curve::Line(n, d)] => {
            (n[0] * c[0] + n[1] * c[1] - d).abs() - r
        }
        [Curve::Circle(c, r), Curve::Circle(e, s)] => {
            let apart = (c[0] - e[0]).hypot(c[1] - e[1]);
            if outside { apart - (r + s) } else { apart - (r - s).abs() }
        }
        // two lines cross at an angle that no size changes
        [Curve::Line(n, _), Curve::Line(m, _)] => n[0] * m[1] - n[1] * m[0],
    }
}

/// The curve that `of`, one of the two, is in their section.
fn curve(of: &Shape, a: &Shape, b: &Shape, section: Section) -> Curve {
    // what has an axis says where the section lies
    let axial = |s: &Shape| !matches!(s.family, Family::Plane | Family::Sphere);
    let frame = match (axial(a), axial(b)) {
        (true, _) => a,
        (false, true) => b,
        (false, false) if a.family == Family::Plane => a,
        _ => b,
    };
    let from = of.origin - frame.origin;
    if section == Section::Across {
        let [x, y] = [frame.frame.column(0), frame.frame.column(1)];
        let place = [x.dot(&from), y.dot(&from)];
        return if of.family == Family::Plane {
            let (n, m) = (x.dot(&of.w()), y.dot(&of.w()));
            let length = n.hypot(m).max(1e-300);
            Curve::Line([n / length, m / length], (n * place[0] + m * place[1]) / length)
        } else {
            Curve::Circle(place, of.size[0])
        };
    }
    let w = frame.w();
    let height = from.dot(&w);
    match of.family {
        Family::Plane => Curve::Line([0.0, 1.0], height),
        Family::Cylinder | Family::EllipticCylinder => Curve::Line([1.0, 0.0], of.size[0]),
        Family::Cone => {
            let up = if of.w().dot(&w) < 0.0 { -1.0 } else { 1.0 };
            let (sin, cos) = of.size[1].sin_cos();
            let normal = [cos, -sin * up];
            Curve::Line(normal, cos * of.size[0] - sin * up * height)
        }
        Family::Torus => Curve::Circle([of.size[0], height], of.size[1]),
        Family::Sphere | Family::Ellipsoid => Curve::Circle([0.0, height], of.size[0]),
    }
}

/// Places of axes or centres in the plane across the first one's axis, about the first.
fn places(faces: &[usize], of: &dyn Fn(usize) -> Shape) -> Vec<[f64; 2]> {
    let first = of(faces[0]);
    let place = |&k: &usize| {
        let v = across(&first, &(of(k).origin - first.origin));
        [v[0], v[1]]
    };
    faces.iter().map(place).collect()
}

fn circle(
    faces: &[usize],
    at: &[i32],
    step: f64,
    centred: bool,
    of: &dyn Fn(usize) -> Shape,
) -> Vec<f64> {
    let z = places(faces, of);
    let turned = |[x, y]: [f64; 2], angle: f64| {
        let (sin, cos) = angle.sin_cos();
        [x * cos - y * sin, x * sin + y * cos]
    };
    // z1 - c = t (z0 - c) gives c = (z1 - t z0) / (1 - t)
    let angle = step * f64::from(at[1] - at[0]);
    let t = turned(z[0], angle);
    let by = turned([1.0, 0.0], angle);
    let (over, under) = ([z[1][0] - t[0], z[1][1] - t[1]], [1.0 - by[0], -by[1]]);
    let square = under[0].powi(2) + under[1].powi(2);
    let c = [
        (over[0] * under[0] + over[1] * under[1]) / square,
        (over[1] * under[0] - over[0] * under[1]) / square,
    ];
    let mut out = Vec::new();
    let count = faces.len() - usize::from(centred);
    for k in 2..count {
        let arm = [z[0][0] - c[0], z[0][1] - c[1]];
        let there = turned(arm, step * f64::from(at[k] - at[0]));
        out.extend([0, 1].map(|i| z[k][i] - c[i] - there[i]));
    }
    if centred {
        out.extend([0, 1].map(|i| z[count][i] - c[i]));
    }
    out
}

fn grid(faces: &[usize], at: &[[i32; 2]], of: &dyn Fn(usize) -> Shape) -> Vec<f64> {
    let z = places(faces, of);
    let has_rows = at.iter().any(|a| a[1] != 0);
    let a = z[1].map(|x| x / f64::from(at[1][0]));
    let b = if has_rows { z[2].map(|x| x / f64::from(at[2][1])) } else { [0.0; 2] };
    let mut out = Vec::new();
    for k in if has_rows { 3 } else { 2 }..faces.len() {
        let [i, j] = at[k].map(f64::from);
        out.extend([0, 1].map(|x| z[k][x] - i * a[x] - j * b[x]));
    }
    if has_rows {
        out.push((a[0] * b[0] + a[1] * b[1]) / (a[0].hypot(a[1]) * b[0].hypot(b[1])).max(1e-300));
    }
    out
}

fn mirror(along: &Shape, pairs: &[[usize; 2]; 2], of: &dyn Fn(usize) -> Shape) -> Vec<f64> {
    let n = along.w();
    let middle = |pair: &[usize; 2]| (of(pair[0]).origin + of(pair[1]).origin) / 2.0;
    let mut out = vec![n.dot(&(middle(&pairs[1]) - middle(&pairs[0])))];
    for pair in pairs {
        let [a, b] = pair.map(of);
        if pair[0] == pair[1] || a.family == Family::Plane {
            continue;
        }
        let apart = b.origin - a.origin;
        if matches!(a.family, Family::Sphere | Family::Ellipsoid | Family::Torus) {
            out.extend(across(along, &apart));
        } else {
            // parallel axes: across the axis and across the normal
            out.push(a.w().cross(&n).dot(&apart));
        }
    }
    out
}
