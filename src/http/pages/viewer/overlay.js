// What is drawn over the points: axes, a scale bar, the scale of deviations, and what was measured.

import { axes, project, scale } from "./camera.js";
import { number } from "./text.js";
import { ramp } from "./render.js";

const AXES = [["x", "#c4322a", "#ff7b72"], ["y", "#1f8a3d", "#5fd07f"], ["z", "#265dc4", "#7fb0ff"]];

/// The largest of 1, 2 and 5 times a power of ten that is no longer than `most` > 0.
export const roundLength = most => {
  const power = Math.floor(Math.log10(most));
  return Number([5, 2, 1].map(digit => `${digit}e${power}`).find(length => Number(length) <= most) ?? `1e${power}`);
};

/// Text with a rim that keeps it readable on any colour.
const write = (ink, text, x, y, colors, align = "center") => {
  ink.textAlign = align;
  ink.textBaseline = "middle";
  ink.lineWidth = 4;
  ink.strokeStyle = colors.back;
  ink.strokeText(text, x, y);
  ink.fillStyle = colors.ink;
  ink.fillText(text, x, y);
};

const line = (ink, from, to, color, width) => {
  ink.strokeStyle = color;
  ink.lineWidth = width;
  ink.lineCap = "round";
  ink.beginPath();
  ink.moveTo(...from);
  ink.lineTo(...to);
  ink.stroke();
};

const triad = (ink, camera, height, colors) => {
  const [right, up, back] = axes(camera), origin = [44, height - 40], length = 28;
  const order = [0, 1, 2].sort((a, b) => back[a] - back[b]);
  for (const k of order) {
    const [name, light, dark] = AXES[k], color = colors.isDark ? dark : light;
    const at = far => [origin[0] + far * right[k], origin[1] - far * up[k]];
    line(ink, origin, at(length), color, 2.5);
    // an axis that points at who looks has no room for its name
    if (Math.hypot(right[k], up[k]) > 0.3) write(ink, name, ...at(length + 10), { ...colors, ink: color });
  }
};

const scaleBar = (ink, camera, width, height, colors) => {
  const pixels = scale(camera, height), length = roundLength(Math.min(180, width / 3) / pixels), long = length * pixels;
  const right = width - 20, left = right - long, y = height - 24;
  for (const [color, thick] of [[colors.back, 5], [colors.ink, 2]]) {
    line(ink, [left, y], [right, y], color, thick);
    for (const x of [left, right]) line(ink, [x, y - 5], [x, y + 5], color, thick);
  }
  write(ink, number(length), (left + right) / 2, y - 12, colors);
  return length;
};

const deviations = (ink, limit, width, colors) => {
  const [left, top, long] = [width - 38, 82, 170];
  for (let k = 0; k < long; k++) {
    ink.fillStyle = `rgb(${ramp(1 - 2 * k / (long - 1))})`;
    ink.fillRect(left, top + k, 14, 1.5);
  }
  ink.lineWidth = 1;
  ink.strokeStyle = colors.ink;
  ink.strokeRect(left - 0.5, top - 0.5, 15, long + 1);
  for (const share of [1, 0.5, 0, -0.5, -1]) {
    const y = top + (1 - share) / 2 * long;
    write(ink, (share > 0 ? "+" : "") + number(share * limit), left - 6, y, colors, "right");
  }
  write(ink, "deviation", left + 14, top - 14, colors, "right");
};

const measured = (ink, picks, matrix, width, height, colors) => {
  const places = picks.map(({ local }) => project(matrix, local, width, height)).filter(Boolean);
  if (places.length === 2) for (const [color, thick] of [[colors.back, 5], [colors.accent, 2]]) line(ink, ...places, color, thick);
  for (const place of places) {
    ink.beginPath();
    ink.arc(...place, 5, 0, 2 * Math.PI);
    ink.fillStyle = colors.accent;
    ink.fill();
    ink.lineWidth = 2;
    ink.strokeStyle = colors.back;
    ink.stroke();
  }
  return places;
};

/// Draws it all on a canvas of `width` x `height` at `density` pixels each; returns the scale bar's length.
export const overlay = (ink, { camera, matrix, width, height, density, colors, limit, picks, distance }) => {
  ink.setTransform(density, 0, 0, density, 0, 0);
  ink.clearRect(0, 0, width, height);
  ink.font = "600 12px system-ui, sans-serif";
  ink.lineJoin = "round";
  triad(ink, camera, height, colors);
  const bar = scaleBar(ink, camera, width, height, colors);
  if (limit > 0) deviations(ink, limit, width, colors);
  const places = measured(ink, picks, matrix, width, height, colors);
  if (places.length === 2) {
    const [x, y] = [0, 1].map(k => (places[0][k] + places[1][k]) / 2);
    write(ink, number(distance), x, y - 12, colors);
  }
  return bar;
};
