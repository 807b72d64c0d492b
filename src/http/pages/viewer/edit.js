// What can be told of the selection: its type and radius, that it is one surface or several, that nothing else matters.

import { make } from "./dom.js";
import { words } from "./text.js";

const TYPES = ["plane", "sphere", "cylinder", "cone", "elliptic_cylinder", "ellipsoid", "torus"];
const ROUND = ["sphere", "cylinder"];

const button = (name, title, action, disabled = false) => {
  const made = make("button", { type: "button", textContent: name, title, disabled });
  made.dataset.edit = name.split(" ")[0].toLowerCase();
  made.onclick = action;
  return made;
};

/// The form that says what a surface is; `on.tell(type, radius)` gets it.
const tellForm = (region, on) => {
  const type = make("select", { ariaLabel: "Its type", id: "tell-type" }, ...TYPES.map(value => make("option", { value, textContent: words(value), selected: value === region?.type })));
  const radius = make("input", { ariaLabel: "Its radius, where it is known", id: "tell-radius", placeholder: "radius", inputMode: "decimal", autocomplete: "off", size: 8 });
  const show = () => { radius.hidden = !ROUND.includes(type.value); };
  type.onchange = show;
  show();
  const form = make("form", { className: "tell" }, make("span", { textContent: "Make this a" }), type, radius, make("button", { textContent: "Run" }));
  form.onsubmit = event => {
    event.preventDefault();
    const value = radius.hidden || radius.value.trim() === "" ? null : Number(radius.value);
    radius.setCustomValidity(value === null || value > 0 ? "" : "A number above 0");
    if (form.reportValidity()) on.tell(type.value, value);
  };
  radius.oninput = () => radius.setCustomValidity("");
  return form;
};

/// What to show for the regions that are `chosen`; `parts` are the points picked of those to split, or null. `free` says
/// whether a point of no surface is picked.
export const edit = ({ chosen, parts, free }, on) => {
  if (parts) {
    return [make("p", { textContent: `Click a point on each part: ${parts.length} so far.` }),
      make("div", { className: "edit" }, button("Split here", "Run with the parts apart", on.split, parts.length < 2), button("Cancel", "Leave it as it is", on.leave))];
  }
  if (free) return [tellForm(null, on)];
  if (!chosen.length) return [];
  const only = button(chosen.length > 1 ? "Only these" : "Only this part", "Run on the boxes around what is selected alone", on.crop);
  if (chosen.length > 1) return [make("div", { className: "edit" }, button("Merge", "They are one surface", on.merge), only)];
  return [tellForm(chosen[0], on), make("div", { className: "edit" }, button("Split", "It is several surfaces: click a point on each", on.part), only)];
};
