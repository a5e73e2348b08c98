/**
 * The page of an exported run: the parts of a session's page, played from the file. The file answers the parts' requests to a server. */

import { answers } from "../shared/api.js";
import { build, CopyButton, elementOf } from "../shared/dom.js";
import { ThemeButton } from "../shared/theme.js";
import { h, html, render } from "../vendor/preact.js";
import { Layers } from "./flat/drawing.js";
import { FlatView } from "./flat/flat_view.js";
import { LayerBoxes } from "./panel.js";
import { Playback } from "./playback.js";
import { plots } from "./plots/plots.js";
import { scrubber } from "./scrubber.js";
import { listen } from "./keys.js";
import { arrange } from "./session_start.js";
import { Steering } from "./steering.js";
import { Store } from "./store.js";
import { Numbers, Status, transport } from "./transport.js";

/** Commands of the recorded run: its frames can be shown, but nothing can be changed. */
class RecordedStore extends Store {
  get isSteerable() {
    return this.isAwake;
  }
}

/** @param {string} id Id of the element with the text. */
const text = (id) => document.getElementById(id)?.textContent ?? "";

async function unpack() {
  const letters = atob(text("drawings"));
  const packed = new Uint8Array(letters.length);
  for (let at = 0; at < letters.length; at += 1) packed[at] = letters.charCodeAt(at);
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).blob();
}

async function begin() {
  const [hello, recording] = [JSON.parse(text("hello")), JSON.parse(text("recording"))];
  const { signal } = new AbortController();
  const store = new RecordedStore({ readOnly: true });
  const layers = new Layers(hello.session.layers);
  const places = /** @type {Record<string, HTMLElement>} */ (
    arrange(/** @type {HTMLElement} */ (document.querySelector("main")), ["scene", "plots", "readout", "transport", "scrubber"])
  );
  const drawn = build("details", { class: "layers" }, build("summary", {}, "What to draw"));
  render(h(LayerBoxes, { layers }), drawn.appendChild(build("div", {})));
  const flat = new FlatView({ layers: Promise.resolve(layers), hasLegend: true }, signal);
  places.scene.append(flat.element, drawn);
  const playback = new Playback(store, flat, recording, await unpack());
  answers["POST sessions/{session}/commands"] = async ({ body }) => {
    await playback.carryOut(body);
    return store.known;
  };
  answers["GET glossary"] = async () => recording.glossary;
  const view = { store, steering: new Steering(store, signal), signal, scene: null, plots: [] };
  transport(places.transport, view, null);
  scrubber(places.scrubber, view);
  render(html`${h(Status, { view })}${h(Numbers, { view })}`, places.readout);
  const plotted = plots(places.plots, view);
  listen(document.body, view, { zoom: async (factor) => (await plotted).zoom(factor) });
  store.receive(hello);
  await playback.show(0);
}

document.querySelector("header")?.append(elementOf(h(ThemeButton, {})));
document.getElementById("recipe")?.after(elementOf(h(CopyButton, { label: "Copy the recipe", text: text("recipe"), what: "the recipe of this run" })));
begin();
