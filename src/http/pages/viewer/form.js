// The parameters, from the contract: what the service takes is what the form asks for.

import { $, make } from "./dom.js";
import { number, words } from "./text.js";

/// Beside these fields stands what the run before found.
const FOUND = ["tolerance", "noise_sigma"];

const field = ({ name, description, schema }) => {
  const options = schema.enum || (schema.type === "boolean" && ["true", "false"]);
  const several = schema.type === "array" && schema.items?.enum;
  if (several) {
    const chosen = schema["x-default"] || several;
    return [make("fieldset", { title: description }, make("legend", { textContent: words(name) }), ...several.map(value =>
      make("label", {}, make("input", { type: "checkbox", name, value, defaultChecked: chosen.includes(value) }), " " + words(value))))];
  }
  const id = "parameter-" + name;
  const input = options
    ? make("select", { id, name, title: description }, make("option", { value: "", textContent: name === "format" ? "told from the file" : schema["x-default"] === undefined ? "" : `${schema["x-default"]} (default)` }),
      ...options.map(word => make("option", { value: word, textContent: words(word) })))
    : make("input", { id, name, title: description, placeholder: schema["x-default"] ?? "", autocomplete: "off" });
  return [make("label", { htmlFor: id, textContent: words(name), title: description }), input,
    ...(FOUND.includes(name) ? [make("output", { id: "found-" + name, htmlFor: id })] : [])];
};

/// Fills the form.
export const build = parameters => {
  // the format first: it is about the file, not about the method
  const order = [...parameters].sort((a, b) => (b.name === "format") - (a.name === "format"));
  $("parameters").append(...order.flatMap(field));
};

/// What the form says that is not the default, as a query.
export const query = name => {
  const form = $("parameters"), given = new URLSearchParams();
  for (const element of form.elements) {
    if (!element.name || element.type === "checkbox" || element.value.trim() === "") continue;
    given.set(element.name, element.value.trim());
  }
  for (const list of form.querySelectorAll("fieldset")) {
    const boxes = [...list.querySelectorAll("input")], chosen = boxes.filter(box => box.checked);
    const same = boxes.every(box => box.checked === box.defaultChecked);
    if (!same && chosen.length) given.set(boxes[0].name, chosen.map(box => box.value).join(","));
  }
  if (name) given.set("name", name);
  return given.toString();
};

/// Shows beside the fields what a run found and used.
export const showFound = used => {
  for (const name of FOUND) {
    const value = used?.[name], given = $("parameters").elements[name]?.value.trim();
    const output = $("found-" + name);
    if (output) output.textContent = value == null ? "" : given ? `used ${number(value)}` : `found ${number(value)}`;
  }
};
