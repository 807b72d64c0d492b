// Where clouds come from: a file chosen or dropped, or the example.

import { $ } from "./dom.js";
import { example } from "./example.js";

/// Gives each cloud and its name to `give`.
export const onFile = give => {
  $("file").onchange = () => {
    const [file] = $("file").files;
    if (file) give(file, file.name);
    $("file").value = "";
  };
  for (const kind of ["dragover", "dragleave", "drop"]) addEventListener(kind, event => {
    event.preventDefault();
    document.body.classList.toggle("over", kind === "dragover");
    const file = kind === "drop" && event.dataTransfer.files[0];
    if (file) give(file, file.name);
  });
  $("example").onclick = () => give(example(), "example.xyz");
};
