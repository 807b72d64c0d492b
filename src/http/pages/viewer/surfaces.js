// Surfaces as the page needs them: normals to light points by, and what lies between two of them.

const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const along = (p, d, s) => [p[0] + s * d[0], p[1] + s * d[1], p[2] + s * d[2]];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = a => Math.hypot(a[0], a[1], a[2]);

/// A function from a point to the surface's normal there (of any length), about `middle`; null where the region has
/// no surface.
export const normalOf = (region, middle) => {
  const s = region.surface;
  if (!s) return null;
  const radial = (point, axis) => {
    const from = sub(point, middle);
    return p => {
      const q = sub(p, from);
      return along(q, axis, -dot(q, axis));
    };
  };
  switch (region.type) {
    case "plane": return () => s.normal;
    case "sphere": { const c = sub(s.center, middle); return p => sub(p, c); }
    case "cylinder": return radial(s.axis_point, s.axis_direction);
    case "cone": {
      const out = radial(s.apex, s.axis_direction), slope = Math.tan(s.half_angle);
      return p => { const r = out(p); return along(r, s.axis_direction, -slope * norm(r)); };
    }
    case "torus": {
      const c = sub(s.center, middle), out = radial(s.center, s.axis_direction);
      // from the tube's middle line
      return p => { const r = out(p), scale = s.major_radius / (norm(r) || 1); return sub(sub(p, c), r.map(v => scale * v)); };
    }
    case "elliptic_cylinder":
    case "ellipsoid": {
      const c = sub(s.center || s.axis_point, middle);
      return p => {
        const q = sub(p, c);
        return s.semi_axis_directions.reduce((sum, d, k) => along(sum, d, dot(q, d) / s.semi_axes[k] ** 2), [0, 0, 0]);
      };
    }
  }
  return null;
};

/// Three signed bytes a point; zeros where there is no normal.
export const normals = (cloud, regions) => {
  const bytes = new Int8Array(3 * cloud.count), of = regions.map(region => normalOf(region, cloud.middle));
  const { positions, labels } = cloud;
  for (let k = 0; k < cloud.count; k++) {
    const normal = of[labels[k]]?.([positions[3 * k], positions[3 * k + 1], positions[3 * k + 2]]);
    if (!normal) continue;
    const scale = 127 / (norm(normal) || 1);
    for (let axis = 0; axis < 3; axis++) bytes[3 * k + axis] = Math.round(scale * normal[axis]);
  }
  return bytes;
};

/// What a surface is measured from: a plane, an axis, or a centre.
const feature = ({ type, surface: s }) => {
  if (!s) return null;
  if (type === "plane") return { plane: true, point: s.point, direction: s.normal };
  if (s.axis_direction) return { axis: true, point: s.axis_point || s.apex || s.center, direction: s.axis_direction };
  return { centre: true, point: s.center };
};

/// Two directions nearer to each other than this are taken for parallel, in radians: a distance makes sense there.
const PARALLEL = 0.02;

/// Distance and angle (radians) between the planes, axes or centres of two regions; what makes no sense is left out.
export const between = (first, second) => {
  let a = feature(first), b = feature(second);
  if (!a || !b) return null;
  // a plane comes first, then an axis
  const rank = f => (f.plane ? 0 : f.axis ? 1 : 2);
  if (rank(a) > rank(b)) [a, b] = [b, a];
  const name = f => (f.plane ? "plane" : f.axis ? "axis" : "centre"), what = `${name(a)} to ${name(b)}`;
  const offset = sub(b.point, a.point);
  if (b.centre) {
    if (a.plane) return { what, distance: Math.abs(dot(offset, a.direction)) };
    return { what, distance: norm(a.axis ? cross(offset, a.direction) : offset) };
  }
  const sine = norm(cross(a.direction, b.direction)), cosine = Math.abs(dot(a.direction, b.direction));
  const turn = Math.atan2(sine, cosine);
  if (a.plane && b.plane) return { what, angle: turn, ...(turn < PARALLEL && { distance: Math.abs(dot(offset, a.direction)) }) };
  if (a.plane) {
    const angle = Math.PI / 2 - turn;
    return { what, angle, ...(angle < PARALLEL && { distance: Math.abs(dot(offset, a.direction)) }) };
  }
  const normal = cross(a.direction, b.direction);
  const distance = sine < 1e-9 ? norm(cross(offset, a.direction)) : Math.abs(dot(offset, normal)) / sine;
  // axes that are about parallel are as far apart as they are beside each other, not where they would meet
  return { what, angle: turn, distance: turn < PARALLEL ? norm(cross(offset, a.direction)) : distance };
};

/// Between two points: the distance, and its parts along the axes.
export const distance = (a, b) => {
  const parts = sub(b, a);
  return { distance: norm(parts), parts };
};
