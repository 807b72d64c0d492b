//! Whether the faces and edges of a STEP file fit together, and what they measure.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use conicoid::geometry::Vec3;

use super::curves::{STEPS, sample};
use super::step::{File, Value};

/// A surface as the file has it: its kind, placement and sizes.
pub struct Surface {
    pub kind: String,
    pub origin: Vec3,
    pub axes: [Vec3; 3],
    pub sizes: Vec<f64>,
}

/// A face: its name, surface, and lines of points around it; whether its normal is the surface's.
pub struct Face {
    pub name: String,
    pub surface: Surface,
    pub lines: Vec<Vec<Vec3>>,
    pub same_sense: bool,
    edges: Vec<(usize, bool)>,
}

/// A shell, and what its description says.
pub struct Shell {
    pub closed: bool,
    pub faces: Vec<Face>,
    pub description: String,
}

impl Surface {
    fn of(file: &File, id: usize) -> Self {
        let (kind, p) = &file.all[&id];
        let numbers = |p: &[Value]| {
            p.iter()
                .filter_map(|v| if let Value::Number(x) = v { Some(*x) } else { None })
                .collect()
        };
        if kind == "SURFACE_OF_LINEAR_EXTRUSION" {
            let ellipse = file.get(p[1].id(), "ELLIPSE");
            let (origin, axes) = file.placement(ellipse[1].id());
            return Self { kind: kind.clone(), origin, axes, sizes: numbers(ellipse) };
        }
        if kind.is_empty() {
            // An ellipsoid's spline: not measured here.
            return Self {
                kind: "SPLINE".into(),
                origin: Vec3::zeros(),
                axes: [Vec3::x(), Vec3::y(), Vec3::z()],
                sizes: vec![],
            };
        }
        let (origin, axes) = file.placement(p[1].id());
        Self { kind: kind.clone(), origin, axes, sizes: numbers(p) }
    }

    /// Radius about the axis and height over the origin.
    fn polar(&self, x: &Vec3) -> (f64, f64) {
        let d = x - self.origin;
        let h = d.dot(&self.axes[2]);
        ((d - self.axes[2] * h).norm(), h)
    }

    /// Distance of a place from the surface; nought where it is not told here.
    pub fn distance(&self, x: &Vec3) -> f64 {
        let (r, h) = self.polar(x);
        let s = &self.sizes;
        match self.kind.as_str() {
            "PLANE" => h.abs(),
            "CYLINDRICAL_SURFACE" => (r - s[0]).abs(),
            "SPHERICAL_SURFACE" => (r.hypot(h) - s[0]).abs(),
            "CONICAL_SURFACE" => ((r - s[0]) * s[1].cos() - h * s[1].sin()).abs(),
            "TOROIDAL_SURFACE" => ((r - s[0]).hypot(h) - s[1]).abs(),
            "SURFACE_OF_LINEAR_EXTRUSION" => {
                let d = x - self.origin;
                let unit = (d.dot(&self.axes[0]) / s[0]).hypot(d.dot(&self.axes[1]) / s[1]);
                (unit - 1.0).abs() * s[1]
            }
            "SPLINE" => 0.0,
            other => panic!("surface {other}"),
        }
    }
}

impl Face {
    fn of(file: &File, id: usize, tolerance: f64) -> Self {
        let p = file.get(id, "ADVANCED_FACE");
        let surface = Surface::of(file, p[2].id());
        let (mut lines, mut edges) = (Vec::new(), Vec::new());
        for bound in p[1].list() {
            let (_, bound) = &file.all[&bound.id()];
            assert!(bound[2].is_true());
            let (kind, line) = &file.all[&bound[1].id()];
            if kind == "VERTEX_LOOP" {
                continue;
            }
            let (mut points, mut ends) = (Vec::new(), Vec::new());
            for oriented in line[1].list() {
                let o = file.get(oriented.id(), "ORIENTED_EDGE");
                let (edge, forward) = (o[3].id(), o[4].is_true());
                let e = file.get(edge, "EDGE_CURVE");
                assert!(e[4].is_true());
                let mut vertices = [e[1].id(), e[2].id()];
                let mut own =
                    sample(file, e[3].id(), file.vertex(vertices[0]), file.vertex(vertices[1]));
                for (x, v) in [(own[0], vertices[0]), (own[STEPS], vertices[1])] {
                    let gap = (x - file.vertex(v)).norm();
                    assert!(gap < tolerance, "edge #{edge} ends {gap:e} off its vertex #{v}");
                }
                for x in &own {
                    let off = surface.distance(x);
                    assert!(
                        off < tolerance,
                        "edge #{edge} is {off:e} off face #{id}, {}",
                        p[0].text()
                    );
                }
                if !forward {
                    own.reverse();
                    vertices.reverse();
                }
                own.pop();
                points.extend(own);
                ends.push(vertices);
                edges.push((edge, forward));
            }
            for (a, b) in ends.iter().zip(ends.iter().cycle().skip(1)) {
                assert_eq!(a[1], b[0], "a line of face #{id} has a gap");
            }
            lines.push(points);
        }
        Self { name: p[0].text().into(), surface, lines, same_sense: p[3].is_true(), edges }
    }

    /// The face's area, and the integral of x.n over it with the face's own normal, by Green's theorem along its edges.
    pub fn measure(&self) -> (f64, f64) {
        let s = &self.surface;
        // Lines run around the face's normal; the integrals are about the surface's.
        let sign = if self.same_sense { 1.0 } else { -1.0 };
        let reference = self.middle_of_tube();
        let (mut vector, mut sums, mut winding) = (Vec3::zeros(), [0.0; 2], 0.0);
        for line in &self.lines {
            for (a, b) in line.iter().zip(line.iter().cycle().skip(1)) {
                let (p, q) = (a - s.origin, b - s.origin);
                vector += p.cross(&q) * (0.5 * sign);
                let turn = |d: &Vec3| d.dot(&s.axes[1]).atan2(d.dot(&s.axes[0]));
                let mut step = turn(&q) - turn(&p);
                step -= (step / TAU).round() * TAU;
                winding += step * sign / TAU;
                let middle = (a + b) / 2.0;
                for (sum, f) in sums.iter_mut().zip(self.integrands(&middle, reference)) {
                    *sum -= sign * f * step;
                }
            }
        }
        let (area, own) = match s.kind.as_str() {
            "PLANE" => (vector.dot(&s.axes[2]), 0.0),
            "CONICAL_SURFACE" => (sums[0], 0.0),
            "SPHERICAL_SURFACE" => {
                let area = sums[0] + TAU * s.sizes[0].powi(2) * winding.round().abs();
                (area, area * s.sizes[0])
            }
            _ => (sums[0], sums[1]),
        };
        // A cone's integral is nought about its apex.
        let about = match s.kind.as_str() {
            "CONICAL_SURFACE" => s.origin - s.axes[2] * (s.sizes[0] / s.sizes[1].tan()),
            _ => s.origin,
        };
        (area, sign * (own + about.dot(&vector)))
    }

    /// The angle about a torus' tube in the middle of the face's lines.
    fn middle_of_tube(&self) -> f64 {
        let s = &self.surface;
        let major = s.sizes.first().copied().unwrap_or_default();
        let (mut x, mut y) = (0.0, 0.0);
        for p in self.lines.iter().flatten() {
            let (r, h) = s.polar(p);
            let d = (r - major).hypot(h);
            (x, y) = (x + (r - major) / d, y + h / d);
        }
        y.atan2(x)
    }

    /// What is summed times the step of the angle: for the area, and for x.n about the origin.
    fn integrands(&self, x: &Vec3, reference: f64) -> [f64; 2] {
        let s = &self.surface;
        let (r, h) = s.polar(x);
        match s.kind.as_str() {
            "CYLINDRICAL_SURFACE" => [s.sizes[0] * h, s.sizes[0].powi(2) * h],
            "CONICAL_SURFACE" => [r * r / (2.0 * s.sizes[1].sin()), 0.0],
            "SPHERICAL_SURFACE" => [s.sizes[0] * h, 0.0],
            "TOROIDAL_SURFACE" => {
                let (major, minor) = (s.sizes[0], s.sizes[1]);
                let mut v = h.atan2(r - major);
                v -= ((v - reference) / TAU).round() * TAU;
                let own = major * minor * v
                    + (major * major + minor * minor) * v.sin()
                    + major * minor * (v / 2.0 + (2.0 * v).sin() / 4.0);
                [minor * (major * v + minor * v.sin()), minor * own]
            }
            _ => [0.0, 0.0],
        }
    }
}

/// The shells of a file, every edge of which lies on its faces' surfaces and every line of which is closed.
pub fn shells(file: &File, tolerance: f64) -> Vec<Shell> {
    let products: Vec<(&str, &str)> =
        file.named("PRODUCT").map(|(_, p)| (p[0].text(), p[2].text())).collect();
    let mut out = Vec::new();
    for (kind, closed) in [("CLOSED_SHELL", true), ("OPEN_SHELL", false)] {
        for (_, p) in file.named(kind) {
            let faces = p[1].list().iter().map(|f| Face::of(file, f.id(), tolerance)).collect();
            let description = products.iter().find(|d| d.0 == p[0].text()).unwrap().1.to_owned();
            out.push(Shell { closed, faces, description });
        }
    }
    out
}

impl Shell {
    /// How often each edge is used forward and backward.
    pub fn uses(&self) -> BTreeMap<usize, [usize; 2]> {
        let mut uses: BTreeMap<usize, [usize; 2]> = BTreeMap::new();
        for (edge, forward) in self.faces.iter().flat_map(|f| &f.edges) {
            uses.entry(*edge).or_default()[usize::from(*forward)] += 1;
        }
        uses
    }

    /// Number of handles: a closed surface has V - E + F = 2 - 2g where every face is a disc; one with b lines around it counts
    /// 2 - b.
    pub fn genus(&self, file: &File) -> i64 {
        let uses = self.uses();
        let mut vertices: Vec<usize> = uses
            .keys()
            .flat_map(|e| {
                let p = file.get(*e, "EDGE_CURVE");
                [p[1].id(), p[2].id()]
            })
            .collect();
        vertices.sort_unstable();
        vertices.dedup();
        let faces: i64 = self.faces.iter().map(|f| 2 - f.lines.len() as i64).sum();
        let euler = vertices.len() as i64 - uses.len() as i64 + faces;
        assert_eq!(euler % 2, 0);
        1 - euler / 2
    }

    pub fn area(&self) -> f64 {
        self.faces.iter().map(|f| f.measure().0).sum()
    }

    pub fn volume(&self) -> f64 {
        self.faces.iter().map(|f| f.measure().1).sum::<f64>() / 3.0
    }
}

/// Half of a sphere's area.
pub fn hemisphere(radius: f64) -> f64 {
    2.0 * PI * radius * radius
}
