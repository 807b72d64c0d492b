// The key of a service that wants one.

import { $ } from "./dom.js";

/// Asks for a key, `refused` where one was not taken: the key, or null where nobody gives one.
export const askForKey = refused => new Promise(done => {
  const dialog = $("key"), value = $("key-value");
  $("key-refused").hidden = !refused;
  value.value = "";
  let given = null;
  $("key-form").onsubmit = event => {
    event.preventDefault();
    given = value.value;
    dialog.close();
  };
  $("key-cancel").onclick = () => dialog.close();
  dialog.onclose = () => done(given);
  dialog.showModal();
});
