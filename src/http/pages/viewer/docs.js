// The reference, written from the OpenAPI document.
"use strict";
const $ = id => document.getElementById(id);
const make = (tag, properties, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children.filter(child => child !== undefined && child !== null));
  return element;
};
/// Text whose names between backquotes stand in code, one paragraph for each empty line.
const prose = text => (text || "").split("\n\n").map(part =>
  make("p", {}, ...part.split("`").map((piece, i) => i % 2 ? make("code", { textContent: piece }) : piece)));
const inline = text => prose(text).flatMap(p => [...p.childNodes]);
const table = (heads, rows) => make("table", {}, make("thead", {}, make("tr", {}, ...heads.map(head => make("th", { textContent: head })))),
  make("tbody", {}, ...rows.map(cells => make("tr", {}, ...cells.map(cell => make("td", {}, ...[cell].flat()))))));
const code = text => make("code", { textContent: text });
const last = ref => ref.split("/").pop();
const link = name => make("a", { href: "#schema-" + name, textContent: name });

/// What a value may be: its type, words, range and default.
const type = schema => {
  if (!schema) return [];
  if (schema.$ref) return [link(last(schema.$ref))];
  const either = schema.oneOf || schema.anyOf || schema.allOf;
  if (either) return either.filter(s => s.type !== "null").flatMap((s, i) => i ? [" or ", ...type(s)] : type(s));
  if (schema.items || schema.prefixItems) return ["list of ", ...type(schema.items || schema.prefixItems[0]), range(schema)];
  return [[schema.type].flat().filter(t => t && t !== "null").join(" or ") || "any", range(schema)];
};
/// A bound of a range; the largest whole numbers are no doubles, and stand next to a power of two.
const bound = x => x >= 2 ** 53 && Number.isInteger(Math.log2(x)) ? `2^${Math.log2(x)} - 1`
  : Math.abs(x) >= 1e6 ? x.toExponential().replace("e+", "e") : String(Number(x.toPrecision(6)));
const range = s => {
  const parts = [];
  if (s.enum) parts.push(s.enum.join(" | "));
  if (s.exclusiveMinimum !== undefined) parts.push("above " + bound(s.exclusiveMinimum));
  if (s.minimum !== undefined) parts.push("from " + bound(s.minimum));
  if (s.maximum !== undefined) parts.push("to " + bound(s.maximum));
  if (s.minItems && s.minItems === s.maxItems) parts.push(s.minItems + " of them");
  return parts.length ? ": " + parts.join(", ") : "";
};
/// What a field means; where it may be null, that stands at the one form it has otherwise.
const meaning = s => s.description || s.oneOf?.find(form => form.description)?.description;
const example = (method, path, op) => {
  const call = { post: "curl --data-binary @part.ply", delete: "curl -X DELETE", get: "curl" }[method];
  const flags = op.operationId === "getJobEvents" ? " -N" : "";
  if (path.endsWith("/form")) return make("pre", { textContent: `curl -F cloud=@part.ply '${location.origin}${path}'` });
  return make("pre", { textContent: `${call}${flags} '${location.origin}${path.replace("{id}", "ID")}'` });
};
/// JSON with the lists of numbers on one line.
const pretty = value => JSON.stringify(value, null, 2).replace(/\[[^\[\]{}"]*\]/g, list => list.replace(/\s+/g, " "));
const operation = (path, method, op) => {
  const box = make("section", {},
    make("h2", { id: op.operationId }, make("span", { className: "method " + method.toUpperCase(), textContent: method.toUpperCase() }), path),
    make("p", {}, make("b", { textContent: op.summary })), ...prose(op.description), example(method, path, op));
  const body = op.requestBody;
  if (body) {
    box.append(make("h3", { textContent: "Body" }), table(["Content-Type", ""], Object.entries(body.content).map(([name, { schema }]) =>
      [code(name), schema?.$ref ? link(last(schema.$ref)) : "the file's bytes"])));
  }
  if (op.parameters?.length)
    box.append(make("h3", { textContent: "Parameters" }), table(["Name", "In", "Meaning", "Value"],
      op.parameters.map(p => [code(p.name), p.in, inline(p.description), type(p.schema)])));
  box.append(make("h3", { textContent: "Answers" }), table(["Status", "Meaning", "Content-Type"],
    Object.entries(op.responses).map(([status, r]) => [status, inline(r.description),
      Object.entries(r.content || {}).map(([name, { schema }]) =>
        make("div", {}, code(name), " ", ...(schema?.$ref ? [link(last(schema.$ref))] : inline(schema?.description))))])));
  const shown = op.responses["200"]?.content?.["application/json"]?.example;
  if (shown) box.append(make("details", {}, make("summary", { textContent: "An answer" }), make("pre", { textContent: pretty(shown) })));
  return box;
};
const schemaBox = (name, schema) => {
  const box = make("section", {}, make("h3", { id: "schema-" + name, textContent: name }), ...prose(schema.description));
  // a tagged choice lists what each of its forms holds
  for (const form of schema.oneOf || [schema]) {
    const fields = Object.entries(form.properties || {});
    if (form !== schema) box.append(...prose(form.description));
    if (fields.length) box.append(table(["Field", "Meaning", "Value"], fields.map(([field, s]) =>
      [[code(field), form.required?.includes(field) ? "" : make("span", { className: "dim", textContent: " optional" })], inline(meaning(s)), type(s)])));
    else box.append(make("p", {}, ...type(form)));
  }
  return box;
};
fetch("/openapi.json").then(answer => answer.json()).then(api => {
  $("version").textContent = api.info.version;
  $("about").replaceWith(...prose(api.info.description));
  const tags = api.tags.map(tag => tag.name);
  const all = Object.entries(api.paths).flatMap(([path, item]) => Object.entries(item).map(([method, op]) => [path, method, op]));
  const inOrder = tags.flatMap(tag => all.filter(([, , op]) => op.tags.includes(tag)));
  for (const [path, method, op] of inOrder) {
    $("operations").append(operation(path, method, op));
    $("toc").append(make("li", {}, make("a", { href: "#" + op.operationId, textContent: op.summary })));
  }
  for (const [name, schema] of Object.entries(api.components.schemas).sort()) {
    $("schemas").append(schemaBox(name, schema));
    $("toc-schemas").append(make("li", {}, link(name)));
  }
  for (const row of api["x-error-codes"])
    $("codes").append(make("tr", { id: row.code }, make("td", {}, code(row.code)), make("td", { textContent: row.status }), make("td", { textContent: row.title })));
  // the place that the address names came to be only now
  const place = location.hash && $(location.hash.slice(1));
  if (place) {
    place.classList.add("here");
    place.scrollIntoView();
  }
});
