// The buttons that save a result.

import { $, make, save } from "./dom.js";
import { result } from "./service.js";

/// The forms by their media types: what the button says, and the file's ending.
const FORMS = {
  "application/json": ["JSON", "json"], "text/csv": ["CSV", "csv"], "model/ply": ["PLY", "ply"], "model/step": ["STEP", "step"],
  "text/html": ["Report", "html"],
};

/// Shows a button for each of the forms that the service has `offered`, and one for the picture that `view` shows. `scene`
/// is what is saved, `tell` gets what went wrong.
export const saves = (offered, scene, view, tell) => {
  const base = () => scene.name.replace(/\.[^.]*$/, "");
  const button = (name, title, get) => {
    const made = make("button", { type: "button", textContent: name, title, disabled: !scene.place });
    made.onclick = async () => {
      made.disabled = true;
      try {
        await get();
      } catch (error) {
        tell(error.message);
      }
      made.disabled = false;
    };
    return made;
  };
  const forms = Object.entries(FORMS).filter(([type]) => offered.includes(type)).map(([type, [name, ending]]) =>
    button(name, type, async () => save(await (await result(scene.place, type)).blob(), `${base()}-surfaces.${ending}`)));
  const picture = button("Picture", "The view as it is, as a PNG file", async () => save(await view.picture(), `${base()}.png`));
  $("saves").replaceChildren(make("span", { textContent: "Save" }), ...forms, ...(view ? [picture] : []));
};
