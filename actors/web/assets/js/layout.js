// @ts-check
// Where the vertices of a graph are drawn: in layers, from the left to the right. Pure.

import { graphlib, layout } from "../vendor/dagre.esm.js";

/** @typedef {{id: string, width: number, height: number, parent?: string, block: string}} Box */
/** @typedef {[source: string, target: string]} Edge */
/** @typedef {Map<string, {x: number, y: number}>} Positions */

/** Dagre takes seconds for more edges, and overflows the stack on long paths. */
const MAX_EDGES = 300;

const GAP_X = 90;
const GAP_Y = 25;
const BLOCK_GAP = 120;

/** The width by the height of the area that blocks fill. */
const ASPECT = 1.6;

/** How often columns are sorted by the neighbours of their vertices. */
const SWEEPS = 4;

/**
 * Lay out a graph: if it is large, each block (a namespace) by itself, and blocks side by side.
 *
 * @param {Box[]} boxes
 * @param {Edge[]} edges
 * @returns {Positions}
 */
export function layOut(boxes, edges) {
  if (edges.length <= MAX_EDGES) {
    return inLayers(boxes, edges);
  }
  /** @type {Map<string, {boxes: Box[], edges: Edge[]}>} */
  const blocks = new Map();
  /** @type {Map<string, string>} */
  const blockOf = new Map();
  for (const box of boxes) {
    const block = blocks.get(box.block) ?? { boxes: [], edges: [] };
    block.boxes.push(box);
    blocks.set(box.block, block);
    blockOf.set(box.id, box.block);
  }
  for (const edge of edges) {
    const block = blockOf.get(edge[0]);
    if (block !== undefined && block === blockOf.get(edge[1])) {
      blocks.get(block)?.edges.push(edge);
    }
  }
  const largestFirst = [...blocks.values()].sort((a, b) => b.boxes.length - a.boxes.length);
  return pack(largestFirst.map(({ boxes: own, edges: inner }) => [own, inner.length <= MAX_EDGES ? inLayers(own, inner) : inColumns(own, inner)]), BLOCK_GAP);
}

/**
 * Lay out few vertices with few crossings.
 *
 * @param {Box[]} boxes
 * @param {Edge[]} edges
 * @returns {Positions}
 */
function inLayers(boxes, edges) {
  const graph = new graphlib.Graph({ compound: true, multigraph: false });
  graph.setGraph({ rankdir: "LR", nodesep: GAP_Y, ranksep: GAP_X, ranker: "network-simplex" });
  graph.setDefaultEdgeLabel(() => ({}));
  for (const { id, width, height } of boxes) {
    graph.setNode(id, { width, height });
  }
  for (const { id, parent } of boxes) {
    if (parent) {
      graph.setParent(id, parent);
    }
  }
  for (const [source, target] of edges) {
    graph.setEdge(source, target);
  }
  layout(graph);
  return new Map(boxes.map(({ id }) => [id, { x: graph.node(id).x, y: graph.node(id).y }]));
}

/**
 * Lay out many vertices in linear time: in columns by their distance from sources, and within a column near their
 * neighbours. A column that is too tall is split.
 *
 * @param {Box[]} boxes
 * @param {Edge[]} edges
 * @returns {Positions}
 */
function inColumns(boxes, edges) {
  const sizes = new Map(boxes.map((box) => [box.id, box]));
  /** @type {Map<string, string[]>} */
  const before = new Map(boxes.map(({ id }) => [id, []]));
  /** @type {Map<string, string[]>} */
  const after = new Map(boxes.map(({ id }) => [id, []]));
  for (const [source, target] of edges) {
    before.get(target)?.push(source);
    after.get(source)?.push(target);
  }
  const columns = columnsOf([...sizes.keys()], before, after);
  /** @type {Map<string, number>} */
  const rows = new Map();
  columns.forEach((column) => column.forEach((id, row) => rows.set(id, row)));
  for (let sweep = 0; sweep < SWEEPS; sweep += 1) {
    for (const column of sweep % 2 ? columns.toReversed() : columns) {
      const neighbours = sweep % 2 ? after : before;
      const wanted = new Map(column.map((id) => [id, mean(neighbours.get(id)?.map((other) => rows.get(other) ?? 0) ?? [], rows.get(id) ?? 0)]));
      column.sort((a, b) => (wanted.get(a) ?? 0) - (wanted.get(b) ?? 0));
      column.forEach((id, row) => rows.set(id, row));
    }
  }
  const height = Math.max(...boxes.map((box) => box.height)) + GAP_Y;
  const most = Math.ceil(Math.sqrt(boxes.length));
  /** @type {[Box[], Positions][]} */
  const parts = [];
  for (const column of columns) {
    for (let first = 0; first < column.length; first += most) {
      const part = column.slice(first, first + most);
      const positions = new Map(part.map((id, row) => [id, { x: 0, y: row * height }]));
      parts.push([part.map((id) => /** @type {Box} */ (sizes.get(id))), positions]);
    }
  }
  return pack(parts, GAP_X);
}

/**
 * Return vertices by their distance from sources; of a circle without one, from its first vertex.
 *
 * @param {string[]} ids
 * @param {Map<string, string[]>} before
 * @param {Map<string, string[]>} after
 */
function columnsOf(ids, before, after) {
  const sources = ids.filter((id) => !before.get(id)?.length);
  /** @type {Set<string>} */
  const seen = new Set();
  /** @type {string[][]} */
  const columns = [];
  for (const start of [sources, ...ids.map((id) => [id])]) {
    let column = start.filter((id) => !seen.has(id));
    for (let depth = 0; column.length; depth += 1) {
      column.forEach((id) => seen.add(id));
      columns[depth] = [...(columns[depth] ?? []), ...column];
      column = [...new Set(column.flatMap((id) => after.get(id) ?? []))].filter((id) => !seen.has(id));
    }
  }
  return columns;
}

/**
 * @param {number[]} values
 * @param {number} otherwise
 */
function mean(values, otherwise) {
  return values.length ? values.reduce((a, b) => a + b) / values.length : otherwise;
}

/**
 * Put blocks side by side, in several rows.
 *
 * @param {[Box[], Positions][]} blocks
 * @param {number} gap
 * @returns {Positions}
 */
function pack(blocks, gap) {
  const placed = blocks.map(([boxes, positions]) => {
    const at = (/** @type {Box} */ { id }) => positions.get(id) ?? { x: 0, y: 0 };
    const left = Math.min(...boxes.map((box) => at(box).x - box.width / 2));
    const top = Math.min(...boxes.map((box) => at(box).y - box.height / 2));
    const width = Math.max(...boxes.map((box) => at(box).x + box.width / 2)) - left + gap;
    const height = Math.max(...boxes.map((box) => at(box).y + box.height / 2)) - top + gap;
    return { positions, left, top, width, height };
  });
  const area = placed.reduce((sum, { width, height }) => sum + width * height, 0);
  const widest = Math.max(Math.sqrt(area * ASPECT), ...placed.map(({ width }) => width));
  /** @type {Positions} */
  const all = new Map();
  let [x, y, tallest] = [0, 0, 0];
  for (const { positions, left, top, width, height } of placed) {
    if (x + width > widest) {
      [x, y, tallest] = [0, y + tallest, 0];
    }
    for (const [id, position] of positions) {
      all.set(id, { x: position.x - left + x, y: position.y - top + y });
    }
    x += width;
    tallest = Math.max(tallest, height);
  }
  return all;
}
