// A segmented cloud out of the service's PLY.

const SIZES = { char: 1, uchar: 1, short: 2, ushort: 2, int: 4, uint: 4, float: 4, int64: 8, uint64: 8, double: 8 };

/// Whole numbers below `n`, each once, so that any first part of them is spread over the whole: steps of about the
/// golden ratio of `n`, with no divisor in common with it.
export const spread = n => {
  const common = (a, b) => { while (b) [a, b] = [b, a % b]; return a; };
  let step = Math.max(1, Math.round(n * 0.6180339887498949));
  while (common(step, n) !== 1) step++;
  const order = new Uint32Array(n);
  for (let i = 1; i < n; i++) {
    const next = order[i - 1] + step;
    order[i] = next < n ? next : next - n;
  }
  return order;
};

/// Reads x, y, z (doubles), red, green, blue, label and deviation of each vertex. Points that are not finite are left
/// out; the others stand in an order of which any first part is spread over the cloud.
///
/// `positions` are single-precision numbers about `middle`, where that is enough wherever the cloud lies; `exact(i)`
/// is a point as the file has it. `middle` and `radius` are those of the surfaces, `reach` is how far any point is
/// from there; `spacing` is about how far points lie apart.
export const readPly = buffer => {
  const head = new TextDecoder("latin1").decode(buffer.slice(0, 1 << 16));
  const start = head.indexOf("end_header\n") + 11;
  const stride = [...head.slice(0, start).matchAll(/^property (\S+)/gm)].reduce((sum, [, kind]) => sum + SIZES[kind], 0);
  const total = Number(/element vertex (\d+)/.exec(head)[1]);
  const data = new DataView(buffer, start);
  const at = (i, axis) => data.getFloat64(i * stride + 8 * axis, true);
  let n = 0;
  const finite = new Uint32Array(total);
  for (let i = 0; i < total; i++) if (Number.isFinite(at(i, 0))) finite[n++] = i;
  const order = spread(n);
  for (let k = 0; k < n; k++) order[k] = finite[order[k]];
  const labels = new Int32Array(n), deviations = new Float32Array(n), colors = new Map();
  for (let k = 0; k < n; k++) {
    const place = order[k] * stride, label = data.getInt32(place + 27, true);
    labels[k] = label;
    deviations[k] = data.getFloat64(place + 31, true);
    if (!colors.has(label)) colors.set(label, [data.getUint8(place + 24), data.getUint8(place + 25), data.getUint8(place + 26)]);
  }
  const found = [...colors.keys()].some(label => label >= 0);
  const low = [1 / 0, 1 / 0, 1 / 0], high = [-1 / 0, -1 / 0, -1 / 0];
  for (let k = 0; k < n; k++) {
    if (found && labels[k] < 0) continue;
    for (let axis = 0; axis < 3; axis++) {
      const value = at(order[k], axis);
      if (value < low[axis]) low[axis] = value;
      if (value > high[axis]) high[axis] = value;
    }
  }
  const middle = low.map((l, axis) => n ? (l + high[axis]) / 2 : 0);
  const positions = new Float32Array(3 * n);
  let sqReach = 0;
  for (let k = 0; k < n; k++) {
    let sq = 0;
    for (let axis = 0; axis < 3; axis++) {
      const value = at(order[k], axis) - middle[axis];
      positions[3 * k + axis] = value;
      sq += value * value;
    }
    if (sq > sqReach) sqReach = sq;
  }
  const radius = n ? Math.hypot(...high.map((h, axis) => h - low[axis])) / 2 || 1 : 1;
  return {
    positions, labels, deviations, colors, middle, radius, order,
    count: n,
    reach: Math.max(radius, Math.sqrt(sqReach)),
    spacing: spacing(positions, radius),
    exact: k => [0, 1, 2].map(axis => at(order[k], axis)),
  };
};

/// About how far points lie apart: the area of the surfaces, told by the cells of a grid that hold points, over how many
/// there are.
export const spacing = (positions, radius) => {
  const CELLS = 96, side = 2 * radius / CELLS, seen = new Uint8Array(CELLS ** 3);
  let occupied = 0, n = 0;
  for (let i = 0; i < positions.length; i += 3) {
    const x = Math.floor((positions[i] + radius) / side), y = Math.floor((positions[i + 1] + radius) / side);
    const z = Math.floor((positions[i + 2] + radius) / side);
    if (x < 0 || y < 0 || z < 0 || x >= CELLS || y >= CELLS || z >= CELLS) continue;
    const cell = (x * CELLS + y) * CELLS + z;
    n++;
    if (!seen[cell]) {
      seen[cell] = 1;
      occupied++;
    }
  }
  // a surface has about four fifths of a square in a cell that it crosses
  return side * Math.sqrt(0.8 * occupied / Math.max(1, n));
};
