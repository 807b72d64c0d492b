// Where the view stands, and what it does to points. Points are about the cloud's middle; z points up.

const FOCAL = 1.8;
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/// Standard views: turn about z and rise above the plane of x and y, in radians.
export const VIEWS = { corner: [-1, 0.5], front: [-Math.PI / 2, 0], right: [0, 0], top: [-Math.PI / 2, Math.PI / 2] };

/// A camera that has a ball of `radius` about the middle in sight.
export const camera = radius => ({ yaw: VIEWS.corner[0], pitch: VIEWS.corner[1], distance: 2 * radius, target: [0, 0, 0], flat: false });

/// How much of the view what is fitted into it may take, from the middle: above it stand the tools, below it the scale.
const ROOM = 0.8;
/// Points that are looked at to fit a view: their first ones are spread over the cloud.
const ENOUGH = 200000;

/// The camera from where all points whose label `has` are in sight.
export const fitted = (cloud, camera, aspect, has) => {
  const { positions, labels, count, radius } = cloud, [right, up, back] = axes(camera);
  const each = visit => {
    const step = Math.min(count, ENOUGH);
    for (let k = 0; k < step; k++) if (has(labels[k])) visit([positions[3 * k], positions[3 * k + 1], positions[3 * k + 2]]);
  };
  const low = [1 / 0, 1 / 0], high = [-1 / 0, -1 / 0];
  let nearest = -1 / 0, farthest = 1 / 0;
  each(p => {
    [right, up].forEach((axis, k) => {
      const at = dot(axis, p);
      low[k] = Math.min(low[k], at);
      high[k] = Math.max(high[k], at);
    });
    const depth = dot(back, p);
    nearest = Math.max(nearest, depth);
    farthest = Math.min(farthest, depth);
  });
  if (nearest < farthest) return camera;
  const [across, upwards, depth] = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (nearest + farthest) / 2];
  const target = [0, 1, 2].map(k => across * right[k] + upwards * up[k] + depth * back[k]);
  let distance = 1e-3 * radius;
  each(p => {
    const q = p.map((v, k) => v - target[k]), nearer = camera.flat ? 0 : dot(back, q);
    distance = Math.max(distance, nearer + FOCAL / ROOM * Math.max(Math.abs(dot(right, q)) / aspect, Math.abs(dot(up, q))));
  });
  return { ...camera, target, distance };
};

/// Right, up and backward.
export const axes = ({ yaw, pitch }) => {
  const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  return [[-sy, cy, 0], [-sp * cy, -sp * sy, cp], [cp * cy, cp * sy, sp]];
};

/// Pixels for a unit of length at the target's depth, in a view so high.
export const scale = ({ distance }, height) => FOCAL * height / 2 / distance;

/// The matrix of WebGL, column by column; `reach` is how far points are from the middle.
export const matrix = (camera, aspect, reach) => {
  const [right, up, back] = axes(camera), { distance, target, flat } = camera;
  const away = distance + Math.hypot(...target) + reach;
  const near = Math.max(distance - (away - distance), distance / 1000), far = away;
  // rows of the view: an axis, and minus the target along it
  const rows = [[right, -dot(right, target)], [up, -dot(up, target)], [back, -dot(back, target) - distance]];
  const [a, b] = flat ? [-1 / away, 0] : [-(far + near) / (far - near), -2 * far * near / (far - near)];
  // without perspective all is as large as at the target
  const size = flat ? FOCAL / distance : FOCAL;
  const column = j => {
    const v = rows.map(([axis, shift]) => (j < 3 ? axis[j] : shift)), last = j === 3 ? 1 : 0;
    return flat
      ? [size / aspect * v[0], size * v[1], a * (v[2] + last * distance), last]
      : [size / aspect * v[0], size * v[1], a * v[2] + last * b, -v[2]];
  };
  return [0, 1, 2, 3].flatMap(column);
};

/// Where a point is in a view of that size, from the top left; null behind the camera.
export const project = (matrix, [x, y, z], width, height) => {
  const row = k => matrix[k] * x + matrix[4 + k] * y + matrix[8 + k] * z + matrix[12 + k];
  const w = row(3);
  return w > 0 ? [(row(0) / w + 1) / 2 * width, (1 - row(1) / w) / 2 * height] : null;
};

/// The point under a place of the view: of the discs that cover it the one whose middle is nearest to it, on the
/// nearest surface; where none does, a point within `reach` pixels. `size` is what a disc's width is divided by its
/// depth from, `isShown` says whether a label is. -1 where there is none.
export const pick = (cloud, camera, matrix, place, width, height, size, isShown, reach = 8) => {
  const { positions, labels, count, spacing } = cloud, back = axes(camera)[2], shown = new Map();
  let near = [], nearest = -Infinity, covered = false;
  for (let k = 0; k < count; k++) {
    const x = positions[3 * k], y = positions[3 * k + 1], z = positions[3 * k + 2];
    const w = matrix[3] * x + matrix[7] * y + matrix[11] * z + matrix[15];
    if (w <= 0) continue;
    const radius = Math.max(1, size / w / 2), most = Math.max(reach, radius);
    const dx = ((matrix[0] * x + matrix[4] * y + matrix[8] * z + matrix[12]) / w + 1) / 2 * width - place[0];
    if (dx > most || dx < -most) continue;
    const dy = (1 - (matrix[1] * x + matrix[5] * y + matrix[9] * z + matrix[13]) / w) / 2 * height - place[1];
    const off = Math.hypot(dx, dy), covers = off <= radius;
    if (off > most || (covered && !covers)) continue;
    const label = labels[k];
    if (!shown.has(label)) shown.set(label, isShown(label));
    if (!shown.get(label)) continue;
    if (covers && !covered) [covered, near, nearest] = [true, [], -Infinity];
    const depth = back[0] * x + back[1] * y + back[2] * z;
    near.push([k, off, depth]);
    if (depth > nearest) nearest = depth;
  }
  // no deeper than a disc is wide is the same surface
  near = near.filter(([, , depth]) => depth >= nearest - 3 * spacing);
  return near.reduce((best, other) => (other[1] < best[1] ? other : best), [-1, Infinity])[0];
};
