import assert from "node:assert/strict";
import { beforeEach, describe, it } from "node:test";

import { Playback } from "../../frontend_static/session/playback.js";
import { Store } from "../../frontend_static/session/store.js";
import { until } from "../../frontend_static/shared/timing.js";
import { effect } from "../../frontend_static/vendor/preact.js";
import { hello } from "./making.js";

const FRAMES = 5;


describe("a run that is played from a file", () => {
  let playback, recording, shown, store;

  beforeEach(() => {
    globalThis.requestAnimationFrame = (work) => setImmediate(() => work(0));
    globalThis.cancelAnimationFrame = clearImmediate;
    store = new Store({ readOnly: true });
    store.receive(hello({ computed: FRAMES - 1, frames: FRAMES, speed: 0, frame_rate_hz: 30 }));
    shown = [];
    const prepare = async (data) => ({ messages: [], show: () => shown.push(new TextDecoder().decode(data)) });
    recording = { parts: [[[0, 1], [3, 4]], [[1, 2], [3, 4]], [[2, 3], [3, 4]]], every: 2, before_loss: 1, glossary: [] };
    playback = new Playback(store, { prepare }, recording, new Blob(["abcP"]));
  });

  it("shows of each frame its drawing with its pictures, or the last before it", async () => {
    for (const frame of [4, 1, 2, 99, -1]) await playback.carryOut({ kind: "seek", frame });
    assert.deepEqual(shown, ["cP", "aP", "bP", "cP", "aP"]);
    assert.equal(store.known.position, 0);
  });

  it("counts steps from the frame that was asked for, and shows only the newest", async () => {
    await Promise.all(["step", "step", "step"].map((kind) => playback.carryOut({ kind })));
    assert.equal(store.known.position, 3);
    assert.deepEqual(shown, ["bP"]);
    await playback.carryOut({ kind: "back" });
    assert.equal(store.known.position, 2);
  });

  it("goes to before the loss, and stays where it is without one", async () => {
    for (const known of [1, null]) {
      recording.before_loss = known;
      await playback.carryOut({ kind: "before_loss" });
      assert.equal(store.known.position, 1);
    }
  });

  it("plays to the end, and from there once more", async () => {
    for (let round = 0; round < 2; round += 1) {
      const positions = [];
      const stop = effect(() => void positions.push(store.known.position));
      await playback.carryOut({ kind: "play" });
      await until(() => !store.known.playing, new AbortController().signal);
      stop();
      assert.deepEqual(positions.slice(1 + round), [1, 2, 3, 4]);
    }
  });
});
