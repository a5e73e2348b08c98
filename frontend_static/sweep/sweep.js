/** The page of a sweep: finds it, follows its stream, and puts the parts together. */

import { START } from "../shared/address.js";
import { messageOf, statusOf } from "../shared/api.js";
import { fill, h, lastOfAddress, part, setText } from "../shared/dom.js";
import { parameterValue } from "../shared/format.js";
import { navigation } from "../shared/navigation.js";
import { notice } from "../shared/notice.js";
import { presentationButton } from "../shared/presentation.js";
import { Stream } from "../shared/stream.js";
import { sourceCodeButton } from "../shared/source_code.js";
import { explain } from "../shared/terms.js";
import { themeButton } from "../shared/theme.js";
import { sweepStream, sweeps } from "./api.js";
import { bar } from "./bar.js";
import { choices } from "./choices.js";
import { legend } from "./legend.js";
import { Maps } from "./maps.js";
import { RunList } from "./runs.js";
import { SweepStore } from "./store.js";
import { queryOf, viewOf } from "./view.js";

/** @import { SweepMessage } from "../shared/messages.js" */

const SKELETON_AFTER_MS = 200;
const id = lastOfAddress();
const store = new SweepStore(viewOf(new URLSearchParams(location.search)));
/** @type {Stream<SweepMessage>|null} */
let stream = null;

navigation(null);
part("tools").append(sourceCodeButton(() => sweeps.sourceCode(id)), themeButton(), presentationButton());
bar(part("bar"), store);
choices(part("choices"), store);
legend(part("legend"), store);
new Maps(part("maps"), store);
new RunList(part("runs"), store);
store.on(["sweep"], () => {
  setText(part("title"), store.known.title);
  const percent = store.known.state === "running" ? `${Math.floor((100 * store.known.done) / store.known.runs)} % · ` : "";
  document.title = `${percent}${store.known.title} · pftrack`;
});
store.on(["view"], () => {
  history.replaceState(null, "", addressOfView());
  facts();
});
store.on(["connection"], () => {
  part("disconnected").hidden = store.connection !== "lost";
});
begin();

async function begin() {
  const slow = setTimeout(() => fill(part("maps"), ...[0, 1, 2].map(() => h("div", { class: "map-bone shimmer" }))), SKELETON_AFTER_MS);
  try {
    store.begin(await sweeps.show(id));
  } catch (error) {
    clearTimeout(slow);
    if (statusOf(error) === 404) fail("There is no such sweep", "It may have been deleted.");
    else fail("This sweep cannot be shown", messageOf(error));
    return;
  }
  listen();
  clearTimeout(slow);
  let axes = `${store.view.x} ${store.view.y}`;
  store.on(["view"], () => {
    if (axes === `${store.view.x} ${store.view.y}`) return;
    axes = `${store.view.x} ${store.view.y}`;
    stream?.stop();
    listen();
  });
}

function listen() {
  stream = new Stream(
    {
      message: (message) => store.receive(message),
      lost: () => store.setConnection("lost"),
      gone: (error) => {
        store.setConnection("gone");
        if (error.status === 404) fail("This sweep has been deleted", "Only what you downloaded remains.");
        else fail("This sweep cannot be shown", error.message);
      },
    },
    { address: () => sweepStream(id, store.view), look: () => sweeps.cells(id, { x: store.view.x, y: store.view.y }) },
  );
}

/**
 * @param {string} title
 * @param {string} message
 */
function fail(title, message) {
  const words = notice(title, message, { label: "Back to the experiments", href: START });
  document.querySelector("main")?.replaceWith(h("main", { class: "sweep-wait", id: "content", tabindex: -1 }, words));
}

/** What holds for all runs. */
function facts() {
  const { known: sweep } = store;
  const fixed = sweep.fixed.map(({ title, values: [value], ...declaration }) => `${title.toLowerCase()} ${parameterValue(value, declaration)}`);
  const unseen = sweep.axes.filter(({ name }) => name !== store.view.x && name !== store.view.y);
  const pooled = unseen.map(({ title, values }) => `${values.length} values of ${title.toLowerCase()}`);
  const words = [`${sweep.trials} ${sweep.trials === 1 ? "trial" : "trials"} of ${sweep.frames} frames`, `seed ${sweep.seed}`, ...fixed];
  if (pooled.length > 0) words.push(`pooled over ${pooled.join(" and ")}`);
  setText(part("facts"), `${words.join(", ")}. All trackers meet the same seeds. Intervals are Wilson's, 95\u00a0%.`);
  explain(part("facts"), { experiment: sweep.experiment });
}

/** The address names what is shown, so that a link shows the same. */
function addressOfView() {
  const query = queryOf(store.view);
  return query.size > 0 ? `${location.pathname}?${query}` : location.pathname;
}
