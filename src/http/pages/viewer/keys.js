// The keyboard.

/// The actions that have a key of their own.
export const ACTIONS = { h: "hide", i: "isolate", a: "all", u: "unassigned", m: "measure", f: "fit", p: "flat", "?": "keys" };

/// Gives each key that is meant for the page, in lower case, to `press`, which says whether it means something.
export const onKeys = press => addEventListener("keydown", event => {
  if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
  if (/^(input|select|textarea)$/i.test(event.target.tagName) && event.target.type !== "checkbox") return;
  if (press(event.key.toLowerCase())) event.preventDefault();
});
