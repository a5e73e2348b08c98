/** The page of a sweep: finds it, follows its stream, and puts the parts together. */

import { fill, h, lastOfAddress, part, setText } from "../shared/dom.js";
import { parameterValue } from "../shared/format.js";
import { sweepStream, sweeps } from "./api.js";
import { bar } from "./bar.js";
import { choices } from "./choices.js";
import { legend } from "./legend.js";
import { maps } from "./maps.js";
import { runs } from "./runs.js";
import { SweepStore } from "./store.js";
import { Stream } from "../shared/stream.js";
import { themeButton } from "../shared/theme.js";

const SKELETON_AFTER_MS = 200;
const KEPT = { show: "success", measure: "success", x: null, y: null, first: null, second: null, level: "0.01", correction: "none", test: "chi-square" };

const id = lastOfAddress();
const store = new SweepStore(viewOfAddress());
/** @type {Stream|null} */
let stream = null;

part("tools").append(themeButton());
bar(part("bar"), store);
choices(part("choices"), store);
legend(part("legend"), store);
maps(part("maps"), store);
runs(part("runs"), store);
store.on("sweep", () => {
  setText(part("title"), store.known.title);
  const percent = store.known.state === "running" ? `${Math.floor((100 * store.known.done) / store.known.runs)} % · ` : "";
  document.title = `${percent}${store.known.title} · pftrack`;
});
store.on("view", () => {
  history.replaceState(null, "", addressOfView());
  facts();
});
store.on("connection", () => {
  part("disconnected").hidden = store.connection !== "lost";
});
begin();

async function begin() {
  const slow = setTimeout(() => fill(part("maps"), ...[0, 1, 2].map(() => h("div", { class: "map-bone shimmer" }))), SKELETON_AFTER_MS);
  try {
    store.begin(await sweeps.show(id));
  } catch (error) {
    clearTimeout(slow);
    fail(error.status === 404 ? "There is no such sweep" : "This sweep cannot be shown", error.status === 404 ? "It may have been deleted." : error.message);
    return;
  }
  listen();
  clearTimeout(slow);
  let axes = `${store.view.x} ${store.view.y}`;
  store.on("view", () => {
    if (axes === `${store.view.x} ${store.view.y}`) return;
    axes = `${store.view.x} ${store.view.y}`;
    stream?.stop();
    listen();
  });
}

function listen() {
  stream = new Stream(
    id,
    {
      message: (message) => store.receive(message),
      lost: () => store.setConnection("lost"),
      gone: (error) => {
        store.setConnection("gone");
        if (error.status === 404) fail("This sweep has been deleted", "What was downloaded of it is all there is.");
        else fail("This sweep cannot be shown", error.message);
      },
    },
    { address: () => sweepStream(id, store.view), look: () => sweeps.cells(id, { x: store.view.x, y: store.view.y }) },
  );
}

function fail(title, message) {
  document.querySelector("main")?.replaceWith(
    h("main", { class: "sweep-wait" }, h("div", { class: "notice", role: "alert" }, h("h2", {}, title), h("p", {}, message), h("a", { class: "button primary", href: "/" }, "Back to the gallery"))),
  );
}

/** What holds for all runs. */
function facts() {
  const { known: sweep } = store;
  const fixed = sweep.fixed.map(({ title, values: [value], ...declaration }) => `${title.toLowerCase()} ${parameterValue(value, declaration)}`);
  const pooled = sweep.axes.filter(({ name }) => ![store.view.x, store.view.y].includes(name)).map(({ title, values }) => `${values.length} values of ${title.toLowerCase()}`);
  const words = [`${sweep.trials} ${sweep.trials === 1 ? "trial" : "trials"} of ${sweep.frames} frames`, `seed ${sweep.seed}`, ...fixed];
  if (pooled.length > 0) words.push(`pooled over ${pooled.join(" and ")}`);
  setText(part("facts"), `${words.join(", ")}. All methods meet the same seeds. Intervals are Wilson's, 95\u00a0%.`);
}

function viewOfAddress() {
  const query = new URLSearchParams(location.search);
  const view = Object.fromEntries(Object.entries(KEPT).map(([name, usual]) => [name, query.get(name) ?? usual]));
  return { ...view, level: Number(view.level) || 0.01 };
}

/** The address names what is shown, so that a link shows the same. */
function addressOfView() {
  const query = new URLSearchParams();
  for (const [name, usual] of Object.entries(KEPT)) {
    const value = store.view[name];
    if (value !== null && String(value) !== usual) query.set(name, String(value));
  }
  return query.size > 0 ? `?${query}` : location.pathname;
}
