// The surfaces that were found, as a list.

import { $, make } from "./dom.js";
import { count, dimensions, kind, number, words } from "./text.js";

const row = (label, color, title, points, about, { pick, toggle }) => {
  const eye = make("button", { type: "button", className: "eye", ariaPressed: "true", title: "Hide or show" }, make("i"));
  eye.ariaLabel = `Show ${title}`;
  eye.style.setProperty("--color", `rgb(${color})`);
  eye.onclick = () => toggle(label);
  const region = make("button", { type: "button", className: "region", ariaPressed: "false" },
    make("span", { textContent: title }), make("span", { className: "dim", textContent: count(points) }), make("small", { textContent: about }));
  region.onclick = event => pick(label, event.shiftKey || event.ctrlKey || event.metaKey);
  const item = make("li", {}, eye, region);
  item.dataset.label = label;
  return item;
};

/// Shows what `document` holds; `on.pick(label, more)` and `on.toggle(label)` are told of clicks.
export const list = (document, name, colors, on) => {
  const { input, regions, unassigned, timing, parameters, warnings = [] } = document;
  const reasons = Object.entries(unassigned.reasons).map(([reason, points]) => `${count(points)} ${words(reason)}`);
  const told = [["noise", parameters.noise_sigma], ["tolerance", parameters.tolerance]].filter(([, value]) => value != null);
  $("summary").replaceChildren(
    make("b", { textContent: `${count(regions.length)} surface${regions.length === 1 ? "" : "s"}` }),
    ` in ${name}: ${count(input.points)} points, ${timing.total.toFixed(2)} s`,
    make("div", { className: "dim", textContent: told.map(([what, value]) => `${what} ${number(value)}`).join(", ") }));
  $("notes").replaceChildren(...warnings.map(({ message }) => make("div", { textContent: message })));
  const rows = regions.map(region => row(region.id, colors.get(region.id) || [128, 128, 128], `${region.id} ${kind(region)}`, region.point_count,
    [...dimensions(region).map(pair => pair.join(" ")), `rms ${number(region.fit.rms)}`].join(", "), on));
  if (unassigned.count) rows.push(row(-1, colors.get(-1) || [128, 128, 128], "unassigned", unassigned.count, reasons.join(", "), on));
  $("regions").replaceChildren(...rows);
};

/// Marks what is selected and what is not shown.
export const mark = (selected, isShown) => {
  for (const item of $("regions").children) {
    const label = Number(item.dataset.label), [eye, region] = item.children;
    region.ariaPressed = String(selected.has(label));
    eye.ariaPressed = String(isShown(label));
    item.classList.toggle("gone", !isShown(label));
  }
};

/// Brings the row of a region into sight.
export const reveal = label =>
  [...$("regions").children].find(item => item.dataset.label === String(label))?.scrollIntoView({ block: "nearest" });
