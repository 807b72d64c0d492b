// Numbers and names as people read them. Lengths are in the cloud's unit, angles of the service in radians.

export const count = value => value.toLocaleString("en");
export const words = name => name.replaceAll("_", " ");

/// Five significant digits.
export const number = value => {
  if (value === 0 || !Number.isFinite(value)) return String(value);
  const power = Math.floor(Math.log10(Math.abs(value)));
  if (power < -5 || power >= 9) return value.toExponential(4);
  const text = value.toFixed(Math.max(0, 4 - power));
  return text.includes(".") ? text.replace(/\.?0+$/, "") : text;
};

/// A value with two digits of its standard deviation.
export const exact = (value, deviation) => {
  const decimals = 1 - Math.floor(Math.log10(deviation));
  if (!(deviation > 0) || decimals > 12) return number(value);
  const digits = Math.max(0, decimals);
  return `${value.toFixed(digits)} ± ${deviation.toFixed(digits)}`;
};

export const degrees = (value, deviation) => exact(value * 180 / Math.PI, deviation * 180 / Math.PI) + "°";

/// A vector with as many decimals as its largest component deserves.
export const vector = values => {
  const largest = Math.max(...values.map(Math.abs));
  const decimals = largest > 0 ? Math.max(0, Math.min(12, 4 - Math.floor(Math.log10(largest)))) : 0;
  return `(${values.map(value => (Number(value.toFixed(decimals)) || 0).toFixed(decimals)).join(", ")})`;
};

/// The type with its side: "cylinder, hole".
export const kind = region =>
  words(region.type) + (region.side && region.side !== "unknown" ? `, ${region.side}` : "");

/// What a region measures, as a designer says it: pairs of a name and a text, the foremost first.
export const dimensions = region => {
  const deviations = region.uncertainty || {}, all = [];
  const tell = (name, value, show) => value == null || all.push([name, show(value)]);
  const length = field => value => exact(value, deviations[field]);
  tell("ring radius", region.surface?.major_radius, length("major_radius"));
  tell("diameter", region.diameter, length("diameter"));
  tell("diameters", region.diameters, values => values.map((value, k) => exact(value, deviations.diameters?.[k])).join(" × "));
  tell("full angle", region.full_angle, angle => degrees(angle, 2 * deviations.half_angle));
  tell("end diameters", region.end_radii, radii => radii.map(radius => number(2 * radius)).join(" to "));
  tell("length", region.length, length("length"));
  tell("arc", region.arc_angle, angle => degrees(angle, deviations.arc_angle));
  // what goes all round need not be said
  if (region.swept_angle < 2 * Math.PI - 1e-6) tell("swept", region.swept_angle, angle => degrees(angle));
  tell("size", region.size, sides => sides.map(number).join(" × "));
  tell("area", region.area, number);
  tell("seen", region.share_seen, share => `${(100 * share).toFixed(0)} %`);
  return all;
};

/// Where a region lies: pairs of a name and a text.
export const position = region => {
  const all = [], surface = region.surface || {};
  for (const [name, field] of [["point", "point"], ["centre", "center"], ["axis through", "axis_point"], ["apex", "apex"],
    ["normal", "normal"], ["axis", "axis_direction"]]) {
    if (surface[field]) all.push([name, vector(surface[field])]);
  }
  if (region.ends) all.push(["ends", region.ends.map(vector).join(" to ")]);
  return all;
};
