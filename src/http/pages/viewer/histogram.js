// How points deviate from their surfaces, as SVG.

import { ramp } from "./render.js";
import { number } from "./text.js";

const BARS = 41, WIDTH = 300, HEIGHT = 84;

const svg = (tag, attributes, ...children) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
};

/// How many points of those `labels` that `has` deviate by how much: `bars` from -reach to reach, whose outermost ones
/// hold all beyond, and the mean and root mean square.
export const tally = ({ labels, deviations }, has, reach) => {
  const bars = new Array(BARS).fill(0);
  let n = 0, sum = 0, squares = 0;
  for (let k = 0; k < labels.length; k++) {
    if (labels[k] < 0 || !has(labels[k])) continue;
    const value = deviations[k];
    const bar = reach > 0 ? Math.floor((value / reach + 1) / 2 * BARS) : BARS >> 1;
    bars[Math.max(0, Math.min(BARS - 1, bar))]++;
    n++;
    sum += value;
    squares += value * value;
  }
  return { bars, count: n, mean: n ? sum / n : 0, rms: n ? Math.sqrt(squares / n) : 0 };
};

/// The picture of a tally, each bar in the colour that its points have in the view when `limit` is the
/// deepest, or in `color` where that is 0.
export const histogram = ({ bars }, reach, limit, color) => {
  const top = Math.max(1, ...bars), step = WIDTH / BARS;
  const label = (x, text, anchor) => svg("text", { x, y: HEIGHT + 14, "text-anchor": anchor }, text);
  return svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT + 18}`, role: "img", "aria-label": "Histogram of the deviations" },
    ...bars.map((bar, k) => {
      const height = 0.96 * HEIGHT * bar / top, value = reach * ((2 * k + 1) / BARS - 1);
      return svg("rect", { x: k * step, y: HEIGHT - height, width: step - 0.6, height, fill: `rgb(${limit > 0 ? ramp(value / limit) : color})` });
    }),
    svg("path", { d: `M0 ${HEIGHT}H${WIDTH}`, class: "base" }),
    label(0, "−" + number(reach), "start"), label(WIDTH / 2, "0", "middle"), label(WIDTH, number(reach), "end"));
};
