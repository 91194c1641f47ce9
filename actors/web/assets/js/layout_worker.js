// @ts-check
// Lays a graph out in layers, beside the page: hundreds of vertices take seconds.

import { graphlib, layout } from "../vendor/dagre.esm.js";

/** @typedef {{id: string, width: number, height: number, parent?: string}} Box */

self.onmessage = ({ data }) => {
  const { number, boxes, edges } = /** @type {{number: number, boxes: Box[], edges: [string, string][]}} */ (data);
  const graph = new graphlib.Graph({ compound: true, multigraph: false });
  graph.setGraph({ rankdir: "LR", nodesep: 25, ranksep: 90, ranker: edges.length > 300 ? "longest-path" : "network-simplex" });
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
  const positions = boxes.map(({ id }) => {
    const { x, y } = graph.node(id);
    return [id, { x, y }];
  });
  self.postMessage({ number, positions });
};
