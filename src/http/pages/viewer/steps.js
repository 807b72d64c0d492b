// What a person knows and has told: steps on the way from the service's first answer to the wanted one. Each is a hint of
// the contract, and all of them go with every run of the same file.

import { $, make } from "./dom.js";
import { number, words } from "./text.js";

let steps = [];
let changed = () => {};

/// `run` is called when steps have changed, for another run.
export const onSteps = run => { changed = run; };

/// The hints of the next run.
export const hints = () => steps.map(step => step.hint);

/// Adds steps, each a hint and what it says in words, and runs.
export const add = (...more) => {
  steps = [...steps, ...more];
  changed();
};

/// Takes the last step back, and runs.
export const undo = () => {
  if (!steps.length) return;
  steps = steps.slice(0, -1);
  changed();
};

/// Forgets all steps: they were another file's.
export const forget = () => { steps = []; };

const OUTCOMES = { applied: "done", contradicted: "the points deny it", not_found: "no points there" };

/// Shows the steps with what became of each, `outcomes` being the result's.
export const showSteps = (outcomes = []) => {
  const of = new Map(outcomes.map(outcome => [outcome.hint, outcome]));
  const row = (step, index) => {
    const told = of.get(index), off = make("button", { type: "button", className: "off", textContent: "×", title: "Take this step back" });
    off.ariaLabel = `Take back: ${step.text}`;
    off.onclick = () => {
      steps = steps.filter(other => other !== step);
      changed();
    };
    const values = [["scatter", told?.scatter], ["misfit", told?.misfit]].filter(([, value]) => value != null).map(([name, value]) => `${name} ${number(value)} σ`);
    const about = make("small", { textContent: told ? [OUTCOMES[told.outcome] || words(told.outcome), told.message, ...values].join("; ") : "" });
    return make("li", { className: told && told.outcome !== "applied" ? "denied" : "" }, make("span", { textContent: step.text }), off, about);
  };
  $("steps").hidden = !steps.length;
  $("told").replaceChildren(...steps.map(row));
};
