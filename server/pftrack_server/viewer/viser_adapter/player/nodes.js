// From what is shown to what is wanted: the messages of viser that lead from one frame's nodes to another's.
/** @import { Description, Moment, Prop, State } from "./recording.js" */
/** @import { Arrays } from "./unpack.js" */

/** @typedef {{state: State, high?: State}} Wanted A node's state, and that in the raised scene where both are needed. */
/** @typedef {{node: number, keys: Record<string, string>, pose: string, visible: boolean}} Shown */

export class Nodes {
  /** @type {Map<string, Shown>} */
  #shown = new Map();
  #description;
  #arrays;

  /**
   * @param {Description} description
   * @param {Arrays} arrays
   */
  constructor(description, arrays) {
    this.#description = description;
    this.#arrays = arrays;
  }

  /**
   * Return the messages that show a moment.
   *
   * @param {Moment} moment
   * @param {number} share How far the scene is raised, 0 to 1.
   * @param {Set<string>} hidden Layers that are not to be seen.
   */
  show(moment, share, hidden) {
    const wanted = this.#wanted(moment, share);
    /** @type {object[]} */
    const messages = [];
    for (const [name, before] of this.#shown) {
      if (wanted.has(name) || !before.visible) continue;
      before.visible = false;
      messages.push(visibility(name, false));
    }
    for (const [name, node] of wanted) messages.push(...this.#change(name, node, share, hidden));
    return messages;
  }

  /**
   * @param {Moment} moment
   * @param {number} share
   */
  #wanted([flat, raised], share) {
    const { nodes, states } = this.#description;
    const nameOf = (/** @type {number} */ index) => nodes[states[index][0]].name;
    /** @type {Map<string, Wanted>} */
    const wanted = new Map((share < 1 ? flat : raised).map((index) => [nameOf(index), { state: states[index] }]));
    for (const index of share > 0 && share < 1 ? raised : []) {
      const node = wanted.get(nameOf(index));
      if (node) node.high = states[index];
    }
    return wanted;
  }

  /**
   * @param {string} name
   * @param {Wanted} wanted
   * @param {number} share
   * @param {Set<string>} hidden
   */
  #change(name, { state, high }, share, hidden) {
    const [node, position, wxyz, isVisible] = state;
    const { type, layer } = this.#description.nodes[node];
    const before = this.#shown.get(name);
    const isNew = before?.node !== node;
    const { keys, updates } = this.#updates(state, high, share, isNew ? {} : before.keys);
    const visible = isVisible === 1 && !hidden.has(layer);
    const pose = JSON.stringify([position, wxyz]);
    /** @type {object[]} */
    const messages = [];
    if (isNew) messages.push({ type, name, owner: "", virtual: false, props: updates });
    else if (Object.keys(updates).length > 0) messages.push({ type: "SceneNodeUpdateMessage", name, owner: "", updates });
    if (isNew || before.pose !== pose) {
      messages.push({ type: "SetOrientationMessage", name, owner: "", wxyz }, { type: "SetPositionMessage", name, owner: "", position });
    }
    if (isNew || before.visible !== visible) messages.push(visibility(name, visible));
    this.#shown.set(name, { node, keys, pose, visible });
    return messages;
  }

  /**
   * What is not as it was, by the name of viser's property.
   *
   * @param {State} state
   * @param {State|undefined} high
   * @param {number} share
   * @param {Record<string, string>} before
   */
  #updates(state, high, share, before) {
    const [props, raised] = [this.#props(state), high ? this.#props(high) : {}];
    /** @type {Record<string, string>} */
    const keys = {};
    /** @type {Record<string, unknown>} */
    const updates = {};
    for (const [name, prop] of Object.entries(props)) {
      const [one, other] = [JSON.stringify(prop), JSON.stringify(raised[name] ?? prop)];
      keys[name] = one === other ? one : `${one} ${other} ${share}`;
      if (keys[name] !== before[name]) updates[name] = one === other ? this.#arrays.value(prop) : this.#between(prop, raised[name], share);
    }
    return { keys, updates };
  }

  /** @param {State} state */
  #props([node, , , , changed]) {
    return { ...this.#description.nodes[node].props, ...changed };
  }

  /**
   * @param {Prop} flat
   * @param {Prop} raised
   * @param {number} share
   */
  #between(flat, raised, share) {
    const [low, high] = [this.#arrays.value(flat), this.#arrays.value(raised)];
    if (!(low instanceof Float32Array && high instanceof Float32Array && low.length === high.length)) return high;
    return low.map((value, at) => value + share * (high[at] - value));
  }
}

/**
 * @param {string} name
 * @param {boolean} visible
 */
function visibility(name, visible) {
  return { type: "SetSceneNodeVisibilityMessage", name, owner: "", visible };
}
