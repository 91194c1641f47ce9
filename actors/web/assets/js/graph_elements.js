// @ts-check
// What is drawn of a graph document: pure, so that it can be tested without a browser.

import { labelsText } from "./format.js";

/**
 * @typedef {object} Vertex
 * @property {"node" | "topic" | "service" | "action"} kind
 * @property {string} name
 * @property {string} [broker]
 * @property {Record<string, string>} [labels] of a node
 * @property {string[]} [types]
 * @property {string} [state]
 * @property {number} [messages_per_sec]
 * @property {number} [bytes_per_sec]
 * @property {number} [drops_per_sec]
 * @property {number} [dropped]
 */
/** @typedef {{source: string, target: string, relation: string, mismatch?: boolean}} Edge */
/** @typedef {{text: string, vertices: string[]}} Mismatch */
/**
 * @typedef {object} GraphDocument
 * @property {Record<string, Vertex>} [vertices]
 * @property {Record<string, Edge>} [edges]
 * @property {Record<string, Mismatch>} [mismatches]
 */
/** @typedef {Record<string, string | number | boolean | undefined>} Data */
/** @typedef {Map<string, Data>} Elements by id; edges have `source` and `target` */

/**
 * Return the namespace of a full name: "/" for those at the top.
 *
 * @param {string} name
 */
export function namespaceOf(name) {
  return name.slice(0, Math.max(1, name.lastIndexOf("/")));
}

/**
 * Return the elements of a drawing.
 *
 * @param {GraphDocument} document
 * @param {object} options
 * @param {string} [options.filter] only vertices with this in their name, and their neighbours
 * @param {boolean} [options.grouped] draw namespaces as groups
 * @param {ReadonlySet<string>} [options.folded] namespaces that are drawn as one vertex
 * @param {(value: number) => string} options.rate shows a rate
 * @returns {Elements}
 */
export function elementsOf(document, { filter = "", grouped = false, folded = new Set(), rate }) {
  const vertices = document.vertices ?? {};
  const edges = Object.entries(document.edges ?? {});
  const shown = new Set(Object.keys(vertices));
  if (filter) {
    const found = new Set([...shown].filter((id) => vertices[id].name.includes(filter)));
    const ends = edges.map(([, { source, target }]) => [source, target]).filter((pair) => pair.some((id) => found.has(id)));
    const kept = new Set([...found, ...ends.flat()]);
    shown.forEach((id) => kept.has(id) || shown.delete(id));
  }
  /** @type {Elements} */
  const elements = new Map();
  /** @type {Map<string, string>} the id of the element that shows a vertex */
  const shownAs = new Map();
  for (const id of shown) {
    const vertex = vertices[id];
    const namespace = namespaceOf(vertex.name);
    const group = `group ${namespace}`;
    if (grouped && namespace !== "/") {
      elements.set(group, { kind: "group", label: namespace, folded: folded.has(namespace) });
      if (folded.has(namespace)) {
        shownAs.set(id, group);
        continue;
      }
    }
    shownAs.set(id, id);
    elements.set(id, {
      kind: vertex.kind,
      label: labelOf(vertex, grouped && namespace !== "/" ? namespace : "", rate),
      parent: grouped && namespace !== "/" ? group : undefined,
      suspended: vertex.state === "suspended",
      dropping: Boolean(vertex.drops_per_sec),
    });
  }
  for (const [id, { source, target, relation, mismatch: isApart }] of edges) {
    const from = shownAs.get(source);
    const to = shownAs.get(target);
    if (from === undefined || to === undefined || from === to) {
      continue;
    }
    const drawn = from === source && to === target ? id : `${from} ${relation} ${to}`;
    const topic = relation === "publishes" ? vertices[target] : relation === "subscribes" ? vertices[source] : undefined;
    const mismatch = Boolean(isApart || elements.get(drawn)?.mismatch);
    elements.set(drawn, {
      source: from,
      target: to,
      relation,
      label: mismatch ? "does not match" : edgeLabel(topic, rate),
      dropping: relation === "subscribes" && Boolean(topic?.drops_per_sec),
      mismatch,
    });
  }
  return elements;
}

/**
 * @param {Vertex} vertex
 * @param {string} namespace that its group shows
 * @param {(value: number) => string} rate
 */
function labelOf(vertex, namespace, rate) {
  const name = namespace ? vertex.name.slice(namespace.length + 1) : vertex.name;
  const lines = [name];
  if (vertex.broker) {
    lines.push(`(${vertex.broker})`);
  }
  if (vertex.labels) {
    lines.push(`[${labelsText(vertex.labels)}]`);
  }
  if (vertex.state === "suspended") {
    lines.push("suspended");
  }
  if (vertex.kind === "topic" && vertex.drops_per_sec) {
    lines.push(`${rate(vertex.drops_per_sec)} dropped/s`);
  }
  return lines.join("\n");
}

/**
 * @param {Vertex | undefined} topic
 * @param {(value: number) => string} rate
 */
function edgeLabel(topic, rate) {
  return topic?.messages_per_sec ? `${rate(topic.messages_per_sec)}/s` : "";
}

/**
 * Return positions for newcomers: near the middle of their neighbours, where nothing is yet.
 *
 * @param {string[]} ids the newcomers
 * @param {Elements} elements
 * @param {Map<string, {x: number, y: number}>} positions of the others; newcomers are added
 */
export function placeNear(ids, elements, positions) {
  /** @type {Map<string, string[]>} */
  const neighbours = new Map();
  for (const { source, target } of elements.values()) {
    if (typeof source === "string" && typeof target === "string") {
      neighbours.set(source, [...(neighbours.get(source) ?? []), target]);
      neighbours.set(target, [...(neighbours.get(target) ?? []), source]);
    }
  }
  const taken = new Set([...positions.values()].map(cell));
  for (const id of ids) {
    const around = (neighbours.get(id) ?? []).flatMap((other) => positions.get(other) ?? []);
    const start = around.length ? middle(around) : { x: 0, y: lowest(positions) + CELL_Y };
    const position = freePosition(start, taken);
    taken.add(cell(position));
    positions.set(id, position);
  }
}

const CELL_X = 190;
const CELL_Y = 80;

/** @param {{x: number, y: number}} position */
function cell({ x, y }) {
  return `${Math.round(x / CELL_X)},${Math.round(y / CELL_Y)}`;
}

/** @param {{x: number, y: number}[]} positions */
function middle(positions) {
  const sum = positions.reduce((a, b) => ({ x: a.x + b.x, y: a.y + b.y }));
  return { x: sum.x / positions.length, y: sum.y / positions.length };
}

/** @param {Map<string, {x: number, y: number}>} positions */
function lowest(positions) {
  return positions.size ? Math.max(...[...positions.values()].map(({ y }) => y)) : 0;
}

/**
 * Return the nearest position in growing squares around a start whose cell is free.
 *
 * @param {{x: number, y: number}} start
 * @param {Set<string>} taken
 */
function freePosition(start, taken) {
  for (let ring = 0; ; ring += 1) {
    for (let row = -ring; row <= ring; row += 1) {
      for (let column = -ring; column <= ring; column += 1) {
        const position = { x: start.x + column * CELL_X, y: start.y + row * CELL_Y };
        if (Math.max(Math.abs(row), Math.abs(column)) === ring && !taken.has(cell(position))) {
          return position;
        }
      }
    }
  }
}
