// What holds between the surfaces, as a list: a click selects those that it is about.

import { $, make } from "./dom.js";
import { count, degrees, exact, number, words } from "./text.js";

const ANGLES = ["parallel", "perpendicular", "equal_angle"];

/// Who is related, in words: "0, 4 to 7"; pairs of mirrored ones as "0 and 4, 1 and 5".
const related = ({ kind, regions, to = [] }) => {
  if (kind !== "symmetric") return regions.join(", ") + (to.length ? ` to ${to.join(", ")}` : "");
  const pairs = [];
  for (let k = 0; k + 1 < regions.length; k += 2) pairs.push(regions[k] === regions[k + 1] ? regions[k] : `${regions[k]} and ${regions[k + 1]}`);
  return pairs.join(", ");
};

/// What they have in common beside it.
const common = ({ kind, count: places, value, counts, pitches }) => {
  if (places && value) return `${places} places on diameter ${number(2 * value)}`;
  if (counts) return counts.map((n, k) => `${n} every ${number(pitches[k])}`).slice(0, counts[1] > 1 ? 2 : 1).join(" by ");
  if (value == null) return "";
  return kind === "equal_angle" ? degrees(value) : number(value);
};

const row = (title, about, labels, pick) => {
  const button = make("button", { type: "button", className: "region", ariaPressed: "false" }, make("span", { textContent: title }), make("small", { textContent: about }));
  button.onclick = () => pick(labels);
  const item = make("li", {}, button);
  item.dataset.labels = labels.join(" ");
  return item;
};

/// Shows the relations that are accepted and the measures; `pick(labels)` is told of clicks.
export const showRelations = ({ relations = [], measures = [] }, pick) => {
  const accepted = relations.filter(relation => relation.accepted).map(relation => {
    const show = ANGLES.includes(relation.kind) ? degrees : exact;
    const labels = [...new Set([...relation.regions, ...(relation.to || [])])];
    const off = `deviation ${show(relation.deviation, relation.uncertainty)}`;
    return row(`${words(relation.kind)}: ${related(relation)}`, [common(relation), off].filter(Boolean).join("; "), labels, pick);
  });
  const measured = measures.map(({ kind, regions, value, uncertainty }) =>
    row(`${words(kind)}: ${regions.join(" and ")}`, (kind === "angle" ? degrees : exact)(value, uncertainty), regions, pick));
  $("related").hidden = !accepted.length && !measured.length;
  $("related-count").textContent = `Relations (${count(accepted.length)}), distances and angles (${count(measured.length)})`;
  $("relations").replaceChildren(...accepted, ...measured);
};

/// Marks the relations between exactly those that are selected.
export const markRelations = selected => {
  for (const item of $("relations").children) {
    const labels = item.dataset.labels.split(" ").map(Number);
    item.firstChild.ariaPressed = String(labels.length === selected.size && labels.every(label => selected.has(label)));
  }
};
