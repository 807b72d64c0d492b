// What is told of the selection, as hints of the contract.

import * as steps from "./steps.js";
import { number, words } from "./text.js";

/// A point of a region in its middle, as the file has it: the region is meant wherever the next run draws its border.
const pointOf = (cloud, label) => {
  const { positions, labels, count, exact } = cloud, sum = [0, 0, 0];
  let points = 0, best = -1, least = Infinity;
  for (let k = 0; k < count; k++) {
    if (labels[k] !== label) continue;
    points++;
    for (let axis = 0; axis < 3; axis++) sum[axis] += positions[3 * k + axis];
  }
  for (let k = 0; k < count; k++) {
    if (labels[k] !== label) continue;
    let sq = 0;
    for (let axis = 0; axis < 3; axis++) sq += (positions[3 * k + axis] - sum[axis] / points) ** 2;
    if (sq < least) [best, least] = [k, sq];
  }
  return exact(best);
};

/// What the buttons beside the selection do (`edit.js`); `refresh` shows the scene as it is.
export const telling = (scene, refresh) => {
  const chosen = () => [...scene.selected].filter(label => label >= 0);
  return {
    tell: (type, radius) => {
      const [label] = chosen(), at = label === undefined ? scene.free : pointOf(scene.cloud, label);
      const text = `${label === undefined ? "points on no surface" : label} is a ${words(type)}${radius ? ` of radius ${number(radius)}` : ""}`;
      steps.add({ hint: { at: [at], type, ...(radius && { radius }) }, text });
    },
    merge: () => steps.add({ hint: { action: "merge", at: chosen().map(label => pointOf(scene.cloud, label)) }, text: `${chosen().join(", ")} are one surface` }),
    part: () => { scene.parts = []; refresh(); },
    leave: () => { scene.parts = null; refresh(); },
    split: () => steps.add({ hint: { action: "split", at: scene.parts }, text: `${chosen()[0]} is ${scene.parts.length} surfaces` }),
    crop: () => {
      // the points of the surface lie within the tolerance of it
      const pad = scene.document.parameters.tolerance || 0;
      steps.add(...chosen().map(label => {
        const { min, max } = scene.document.regions[label].extent;
        return { hint: { action: "crop", extent: { min: min.map(v => v - pad), max: max.map(v => v + pad) } }, text: `only the box around ${label}` };
      }));
    },
  };
};
