// The page: what was sent, what came back, and what is shown of it.

import { card } from "./card.js";
import { readPly } from "./cloud.js";
import { $ } from "./dom.js";
import { onFile } from "./file.js";
import * as form from "./form.js";
import { askForKey } from "./key.js";
import { ACTIONS, onKeys } from "./keys.js";
import { list, mark, reveal } from "./list.js";
import { matched, palette } from "./palette.js";
import { markRelations, showRelations } from "./relations.js";
import { FAINT, HIDDEN, SHOWN } from "./render.js";
import { saves } from "./saves.js";
import * as service from "./service.js";
import * as steps from "./steps.js";
import { distance, normals } from "./surfaces.js";
import { telling as makeTelling } from "./telling.js";
import { number } from "./text.js";
import { theme, view as makeView } from "./view.js";

/// The scene: one result and how it is looked at. A run that fails leaves it as it is.
const scene = {
  file: null, name: "", place: null, document: null, cloud: null, colors: new Map(),
  selected: new Set(), hidden: new Set(), isolated: null, deviations: false, limit: 0, measuring: false, picks: [], folded: false,
  parts: null, free: null,
};
let running = null, last = null;

// ---- what is shown ----

const isShown = label => (scene.isolated ? scene.isolated.has(label) : !scene.hidden.has(label));
const limit = () => (scene.deviations ? scene.limit : 0);

const style = () => {
  if (!scene.cloud) return;
  const labels = scene.document.regions.length + 1, texels = new Uint8Array(4 * labels), { faint } = theme();
  for (let label = -1; label < labels - 1; label++) {
    const stands = !scene.selected.size || scene.selected.has(label);
    const color = stands ? scene.colors.get(label) || [128, 128, 128] : faint;
    texels.set([...color, !isShown(label) ? HIDDEN : stands ? SHOWN : FAINT], 4 * (label + 1));
  }
  view?.style(texels, isShown, limit());
};

const press = (action, on) => { document.querySelector(`[data-do=${action}]`).ariaPressed = String(on); };

/// Shows the scene as it is now.
const refresh = () => {
  style();
  mark(scene.selected, isShown);
  markRelations(scene.selected);
  press("surfaces", !scene.deviations);
  press("deviations", scene.deviations);
  press("measure", scene.measuring);
  press("unassigned", Boolean(scene.isolated?.has(-1)) && scene.isolated.size === 1);
  for (const action of ["hide", "isolate"]) document.querySelector(`[data-do=${action}]`).disabled = !scene.selected.size;
  $("limit").hidden = !scene.deviations;
  document.body.classList.toggle("measuring", scene.measuring || Boolean(scene.parts));
  const [a, b] = scene.picks;
  view?.measured(scene.picks, b ? distance(a.point, b.point).distance : 0);
  card({ ...scene, limit: limit() }, () => {
    // the histogram of all is what is left when nothing is selected
    if (!scene.measuring && !scene.selected.size) scene.folded = true;
    scene.selected.clear();
    Object.assign(scene, { measuring: false, picks: [], parts: null });
    refresh();
  }, telling);
};

const select = (label, more) => {
  if (!more) {
    const alone = scene.selected.size === 1 && scene.selected.has(label);
    scene.selected = new Set(alone ? [] : [label]);
  } else if (!scene.selected.delete(label)) {
    scene.selected.add(label);
  }
  Object.assign(scene, { measuring: false, picks: [], parts: null, free: null });
  refresh();
};

const click = (index, more) => {
  if (scene.measuring) {
    if (index < 0) return;
    const { positions, labels, exact } = scene.cloud;
    const picked = { local: [...positions.subarray(3 * index, 3 * index + 3)], point: exact(index), label: labels[index] };
    scene.picks = scene.picks.length === 1 ? [...scene.picks, picked] : [picked];
    return refresh();
  }
  if (scene.parts) {
    // a point of another surface is none of its parts
    if (index >= 0 && scene.selected.has(scene.cloud.labels[index])) scene.parts = [...scene.parts, scene.cloud.exact(index)];
    return refresh();
  }
  if (index < 0) {
    if (!more && scene.selected.size) scene.selected.clear();
    return refresh();
  }
  select(scene.cloud.labels[index], more);
  if (scene.cloud.labels[index] < 0) {
    scene.free = scene.cloud.exact(index);
    refresh();
  }
  reveal(scene.cloud.labels[index]);
};

const view = makeView({
  click,
  doubleClick: index => {
    if (scene.measuring || scene.parts) return;
    const label = index < 0 ? null : scene.cloud.labels[index];
    // the second click has taken back what the first one did
    if (label !== null) scene.selected = new Set([label]);
    refresh();
    view.fit(label === null ? own => own >= 0 && isShown(own) : own => own === label);
  },
  drawn: () => {
    performance.clearMarks("drawn");
    performance.mark("drawn");
  },
  theme: refresh,
});
if (!view) $("hint").textContent = "This browser shows no WebGL 2: the list of surfaces and the files remain.";

const telling = makeTelling(scene, refresh);
steps.onSteps(() => {
  steps.showSteps();
  if (last) segment(last.file, last.name);
});
$("undo").onclick = () => steps.undo();

// ---- what can be done with it ----

const step = by => {
  const labels = [...$("regions").children].map(item => Number(item.dataset.label));
  const at = labels.indexOf([...scene.selected].at(-1));
  const next = labels[(at + by + labels.length) % labels.length] ?? labels[0];
  if (next === undefined) return;
  Object.assign(scene, { selected: new Set([at < 0 && by < 0 ? labels.at(-1) : next]), parts: null, free: null });
  refresh();
  reveal([...scene.selected][0]);
};

const actions = {
  surfaces: () => { scene.deviations = false; },
  deviations: () => { Object.assign(scene, { deviations: true, folded: false }); },
  hide: () => {
    for (const label of scene.selected) {
      if (scene.isolated) scene.isolated.delete(label);
      scene.hidden.add(label);
    }
    scene.selected.clear();
  },
  isolate: () => { if (scene.selected.size) scene.isolated = new Set(scene.selected); },
  unassigned: () => { scene.isolated = scene.isolated?.has(-1) && scene.isolated.size === 1 ? null : new Set([-1]); scene.selected.clear(); },
  all: () => { scene.isolated = null; scene.hidden.clear(); },
  measure: () => { scene.measuring = !scene.measuring; scene.picks = []; if (scene.measuring) scene.selected.clear(); },
  fit: () => view.fit(label => (scene.selected.size ? scene.selected.has(label) : isShown(label) && (label >= 0 || scene.isolated?.has(-1)))),
  flat: () => {
    const on = document.querySelector("[data-do=flat]").ariaPressed !== "true";
    press("flat", on);
    view.flat(on);
  },
  keys: () => $("keys").showModal(),
};
const act = name => {
  if (!scene.cloud && name !== "keys") return;
  actions[name]();
  if (name !== "keys") refresh();
};
$("tools").onclick = event => {
  const button = event.target.closest("[data-do]");
  if (button) act(button.dataset.do);
};
$("stand").onchange = () => view.stand($("stand").value);
$("reach").onchange = () => {
  const value = Number($("reach").value);
  if (value > 0) scene.limit = value;
  $("reach").value = number(scene.limit);
  refresh();
};

const toggle = label => {
  if (scene.isolated) {
    if (!scene.isolated.delete(label)) scene.isolated.add(label);
  } else if (!scene.hidden.delete(label)) {
    scene.hidden.add(label);
  }
  refresh();
};

onKeys(key => {
  const action = ACTIONS[key], stands = ["corner", "front", "right", "top"];
  if (key === "z") steps.undo();
  else if (action) act(action);
  else if (key === "d") act(scene.deviations ? "surfaces" : "deviations");
  else if (key === "n" || key === "b") step(key === "n" ? 1 : -1);
  else if ("1234".includes(key) && scene.cloud && view) view.stand($("stand").value = stands[key - 1]);
  else if (key === "escape" && scene.cloud) {
    if (scene.measuring) Object.assign(scene, { measuring: false, picks: [] });
    else if (scene.parts) scene.parts = null;
    else scene.selected.clear();
    refresh();
  } else return false;
  return true;
});

// ---- runs ----

const tell = message => {
  $("problem").textContent = message;
  $("problem").hidden = false;
  $("problem").scrollIntoView({ block: "nearest" });
};

/// Takes a result in the place of the one that is shown. Of the same file the camera, the colours and what is looked at
/// stay.
const take = (file, name, place, document, cloud) => {
  const same = scene.file === file && scene.cloud?.count === cloud.count;
  const match = same ? matched(scene.cloud.labels, cloud.labels) : new Map();
  const colors = palette(cloud.colors, same ? scene.colors : new Map(), match);
  Object.assign(scene, { file, name, place, document, cloud, colors, selected: new Set(), hidden: new Set(), isolated: null, measuring: false, picks: [], parts: null, free: null });
  if (!same) scene.deviations = false;
  const { tolerance, noise_sigma: noise } = document.parameters;
  scene.limit = tolerance || 4 * noise || Math.max(0, ...document.regions.map(region => region.fit.max)) || 1;
  $("reach").value = number(scene.limit);
  window.document.body.classList.toggle("shown", Boolean(view));
  window.document.title = `${name}: conicoid`;
  $("hint").hidden = Boolean(view);
  $("tools").hidden = !view;
  $("found").hidden = false;
  view?.show(cloud, normals(cloud, document.regions), same);
  // behind the frame that is asked for by now
  requestAnimationFrame(() => requestAnimationFrame(() => performance.mark("shown")));
  form.showFound(document.parameters);
  list(document, name, colors, { pick: select, toggle });
  steps.showSteps(document.hints);
  showRelations(document, labels => {
    Object.assign(scene, { selected: new Set(labels), measuring: false, picks: [], parts: null, free: null });
    refresh();
  });
  for (const button of $("saves").querySelectorAll("button")) button.disabled = false;
  refresh();
  if (!same && matchMedia("(max-width: 50rem)").matches) scrollTo(0, 0);
};

const segment = async (file, name) => {
  if (running) return;
  running = "sending";
  // what was told of another file says nothing of this one
  if (last?.file !== file) steps.forget();
  steps.showSteps();
  last = { file, name };
  $("again").hidden = false;
  $("problem").hidden = true;
  $("work").hidden = false;
  $("found").classList.add("old");
  $("bar").removeAttribute("value");
  $("stage").textContent = "sending " + name;
  try {
    const place = running = await service.submit(file, form.query(name), steps.hints());
    const ended = await service.follow(place, ({ state, progress }) => {
      $("stage").textContent = progress ? progress.stage : state;
      if (progress) $("bar").value = progress.fraction;
    });
    if (ended.state === "cancelled") return;
    if (ended.state !== "succeeded") throw new Error(`${ended.problem.code}\n${ended.problem.detail}`);
    performance.mark("ended");
    $("stage").textContent = "fetching";
    const [document, points] = await Promise.all([service.document(place), service.result(place, "model/ply").then(answer => answer.arrayBuffer())]);
    take(file, name, place, document, readPly(points));
  } catch (error) {
    tell(error.message + (scene.document ? "\nWhat is shown is the result before." : ""));
  } finally {
    running = null;
    $("work").hidden = true;
    $("found").classList.remove("old");
  }
};

$("cancel").onclick = () => running?.startsWith("/") && service.cancel(running).catch(() => {});
$("parameters").onsubmit = event => {
  event.preventDefault();
  if (last) segment(last.file, last.name);
};

service.onKeyWanted(askForKey);
$("keys-close").onclick = () => $("keys").close();

// ---- where clouds come from ----

onFile(segment);

const offer = forms => saves(forms, scene, view, tell);
offer(["application/json", "text/csv", "model/ply"]);
service.contract().then(({ parameters, forms }) => {
  form.build(parameters);
  offer(forms);
  if (location.hash === "#example") $("example").click();
}).catch(error => tell(error.message));
