/** The drop zone: takes a video, a set of pictures or a saved run, and shows how far the upload is. */

import { send } from "../shared/api.js";
import { fill, h, setText } from "../shared/dom.js";
import { bytes } from "../shared/format.js";
import { icon } from "../shared/icons.js";

/**
 * @param {HTMLElement} root
 * @param {{uploaded: (upload: object) => void, imported: (run: object) => void}} on
 */
export function dropZone(root, on) {
  const picker = h("input", {
    type: "file",
    multiple: true,
    class: "visually-hidden",
    id: "file-picker",
    accept: "video/*,image/*,.pft",
    on: { change: () => picker.files.length > 0 && take([...picker.files]) },
  });
  const zone = h("div", { class: "drop" });
  fill(root, zone);
  invite();

  let depth = 0;
  document.addEventListener("dragenter", (event) => {
    if (!hasFiles(event)) return;
    depth += 1;
    zone.classList.add("over");
  });
  document.addEventListener("dragleave", () => {
    depth = Math.max(0, depth - 1);
    if (depth === 0) zone.classList.remove("over");
  });
  document.addEventListener("dragover", (event) => hasFiles(event) && event.preventDefault());
  document.addEventListener("drop", (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    depth = 0;
    zone.classList.remove("over");
    const files = [...(event.dataTransfer?.files ?? [])];
    if (files.length > 0) take(files);
  });

  function invite() {
    picker.value = "";
    fill(
      zone,
      picker,
      icon("film"),
      h("p", { class: "drop-words" }, h("strong", {}, "Drop a video here"), " or ", h("label", { for: "file-picker", class: "link" }, "choose a file")),
      h("p", { class: "hint" }, "A video, an animated GIF or a set of pictures, or a saved run (.pft)"),
    );
  }

  async function take(files) {
    const saved = files.length === 1 && files[0].name.toLowerCase().endsWith(".pft");
    const size = files.reduce((sum, file) => sum + file.size, 0);
    const name = files.length === 1 ? files[0].name : `${files.length} files`;
    const meter = h("progress", { max: 1, value: 0, "aria-label": "Upload" });
    const words = h("p", { class: "hint", role: "status" });
    const transfer = send(saved ? "runs/import" : "uploads", files, (sent, total) => {
      meter.value = total > 0 ? sent / total : 0;
      setText(words, sent < total ? `${bytes(Math.min(sent, size))} of ${bytes(size)}` : saved ? "Reading the run" : "Checking every frame");
      if (sent >= total) meter.removeAttribute("value");
    });
    fill(
      zone,
      h("p", { class: "drop-words" }, name),
      meter,
      words,
      h("button", { type: "button", on: { click: () => transfer.stop() } }, "Stop"),
    );
    try {
      const answer = await transfer.done;
      invite();
      if (saved) on.imported(answer);
      else on.uploaded(answer);
    } catch (error) {
      if (error.status === -1) invite();
      else refuse(name, error.message);
    }
  }

  function refuse(name, message) {
    fill(
      zone,
      h("p", { class: "drop-words" }, h("strong", {}, `${name} was not accepted`)),
      h("p", { class: "wrong", role: "alert" }, message),
      h("button", { type: "button", autofocus: true, on: { click: invite } }, "Choose another file"),
    );
  }
}

function hasFiles(event) {
  return event.dataTransfer?.types.includes("Files") ?? false;
}
