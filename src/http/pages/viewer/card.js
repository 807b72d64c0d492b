// What is known of the selection, over the view.

import { $, facts, make } from "./dom.js";
import { edit } from "./edit.js";
import { histogram, tally } from "./histogram.js";
import { between, distance } from "./surfaces.js";
import { count, degrees, dimensions, kind, number, position, vector, words } from "./text.js";

const head = (region, color) => {
  const swatch = make("i");
  swatch.style.setProperty("--color", `rgb(${color})`);
  return make("h2", {}, swatch, `${region.id} ${kind(region)}`);
};

const about = region => {
  const unknown = region.uncertainty?.not_identifiable;
  return facts([...dimensions(region), ...position(region), ["points", count(region.point_count)],
    ["rms", number(region.fit.rms)], ["noise", number(region.fit.noise)], ["largest", number(region.fit.max)],
    ...(unknown ? [["not told by the points", unknown.map(words).join(", ")]] : []),
    ...(region.neighbours.length ? [["beside", region.neighbours.map(other => `${other.region} (${other.continuity})`).join(", ")]] : [])]);
};

const pair = (first, second) => {
  const told = between(first, second);
  if (!told) return make("p", { className: "dim", textContent: "These have no plane, axis or centre to measure from." });
  return make("div", {}, make("h3", { textContent: `${first.id} and ${second.id}: ${told.what}` }), facts([
    ...(told.distance === undefined ? [] : [["distance", number(told.distance)]]),
    ...(told.angle === undefined ? [] : [["angle", degrees(told.angle)]])]));
};

const measured = (picks, regions) => {
  if (picks.length < 2) return [make("h2", { textContent: "Measure" }), make("p", { className: "dim", textContent: picks.length ? "Click the second point." : "Click two points." }),
    ...(picks.length ? [facts([["from", vector(picks[0].point)]])] : [])];
  const { distance: far, parts } = distance(picks[0].point, picks[1].point);
  const [a, b] = picks.map(pick => regions[pick.label]);
  return [make("h2", { textContent: `Distance ${number(far)}` }),
    facts([["along x, y, z", parts.map(number).join(", ")], ["from", vector(picks[0].point)], ["to", vector(picks[1].point)]]),
    ...(a && b && a !== b ? [pair(a, b)] : [])];
};

/// The histogram of some labels, or of all.
const spread = (cloud, has, limit, color = [110, 140, 180]) => {
  const { rms } = tally(cloud, has, 0), reach = limit > 0 ? 1.25 * limit : 4 * rms, told = tally(cloud, has, reach);
  if (!told.count) return [];
  return [histogram(told, reach, limit, color), make("p", { className: "dim", textContent: `${count(told.count)} points, mean ${number(told.mean)}, rms ${number(told.rms)}` })];
};

/// Shows what is selected or measured; `close` is called when it is closed. `limit` is the deviation with the deepest
/// colour, 0 where surfaces have their own. `on` is told what is said of the selection (`edit.js`).
export const card = ({ document, cloud, colors, selected, measuring, picks, parts, free, limit, folded }, close, on) => {
  const regions = document?.regions || [], chosen = [...selected].filter(label => label >= 0).map(label => regions[label]);
  let children = [];
  if (measuring) children = measured(picks, regions);
  else if (chosen.length === 1) children = [head(chosen[0], colors.get(chosen[0].id)), about(chosen[0]), ...spread(cloud, label => label === chosen[0].id, limit, colors.get(chosen[0].id))];
  else if (chosen.length === 2) children = [...chosen.map(region => head(region, colors.get(region.id))), pair(...chosen), ...spread(cloud, label => selected.has(label), limit)];
  else if (chosen.length) children = [make("h2", { textContent: `${chosen.length} surfaces` }), ...spread(cloud, label => selected.has(label), limit)];
  else if (limit > 0 && !folded) children = [make("h2", { textContent: "All surfaces" }), ...spread(cloud, () => true, limit)];
  if (!measuring) {
    const more = edit({ chosen, parts, free: free && selected.has(-1) && selected.size === 1 }, on);
    if (more.length && !children.length) children = [make("h2", { textContent: "Points on no surface" })];
    children.push(...more);
  }
  const shut = make("button", { type: "button", className: "close", textContent: "×", ariaLabel: "Close" });
  shut.onclick = close;
  $("card").replaceChildren(...(children.length ? [shut, ...children] : []));
  $("card").hidden = !children.length;
};
