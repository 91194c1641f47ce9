import assert from "node:assert/strict";
import { test } from "node:test";

import { elementsOf, namespaceOf, placeNear } from "../js/graph_elements.js";

/** Return a graph document of edges such as "/a publishes /t" and "/t subscribes /b". */
function graph(...lines) {
  const vertices = Object.create(null);
  const edges = Object.create(null);
  for (const line of lines) {
    const [from, relation, to] = line.split(" ");
    const kinds = relation === "publishes" ? ["node", "topic"] : ["topic", "node"];
    const [source, target] = [`${kinds[0]} ${from}`, `${kinds[1]} ${to}`];
    vertices[source] ??= { kind: kinds[0], name: from };
    vertices[target] ??= { kind: kinds[1], name: to };
    edges[`${source} ${relation} ${target}`] = { source, target, relation };
  }
  return { vertices, edges };
}

const CHAIN = graph("/a publishes /t", "/t subscribes /b", "/b publishes /u", "/u subscribes /c");
const rate = String;

test("each vertex and each edge is an element", () => {
  const elements = elementsOf(CHAIN, { rate });
  assert.deepEqual([...elements.keys()].sort(), [...Object.keys(CHAIN.vertices), ...Object.keys(CHAIN.edges)].sort());
  assert.equal(elementsOf({}, { rate }).size, 0);
});

test("a filter leaves what it finds and its neighbours, not their neighbours", () => {
  const elements = elementsOf(CHAIN, { filter: "/a", rate });
  assert.deepEqual([...elements.keys()], ["node /a", "topic /t", "node /a publishes topic /t"]);
});

test("a namespace is a group around what it has, named without it", () => {
  const elements = elementsOf(graph("/x/a publishes /x/t", "/x/t subscribes /b"), { grouped: true, rate });
  assert.deepEqual(elements.get("group /x"), { kind: "group", label: "/x", folded: false });
  assert.deepEqual([elements.get("node /x/a").parent, elements.get("node /x/a").label], ["group /x", "a"]);
  assert.equal(elements.get("node /b").parent, undefined);
});

test("a folded namespace is one vertex with one edge for each relation to the outside", () => {
  const document = graph("/x/a publishes /x/t", "/x/t subscribes /b", "/x/u subscribes /b");
  const elements = elementsOf(document, { grouped: true, folded: new Set(["/x"]), rate });
  assert.deepEqual([...elements.keys()], ["group /x", "node /b", "group /x subscribes node /b"]);
});

test("rates are on the edges of a topic, drops at it and at the edges to its readers", () => {
  const document = graph("/a publishes /t", "/t subscribes /b");
  Object.assign(document.vertices["topic /t"], { messages_per_sec: 5, drops_per_sec: 2 });
  const elements = elementsOf(document, { rate });
  assert.equal(elements.get("topic /t").label, "/t\n2 dropped/s");
  assert.deepEqual(
    ["node /a publishes topic /t", "topic /t subscribes node /b"].map((id) => [elements.get(id).label, elements.get(id).dropping]),
    [["5/s", false], ["5/s", true]],
  );
});

test("a suspended node and the broker of a mesh are in the label", () => {
  const document = graph("/a publishes /t");
  Object.assign(document.vertices["node /a"], { state: "suspended", broker: "alpha" });
  assert.equal(elementsOf(document, { rate }).get("node /a").label, "/a\n(alpha)\nsuspended");
});

test("edges to nodes that do not match are marked, and have no rate", () => {
  const document = graph("/a publishes /t", "/t subscribes /b", "/t subscribes /c");
  document.vertices["topic /t"].messages_per_sec = 5;
  const apart = ["node /a publishes topic /t", "topic /t subscribes node /b"];
  apart.forEach((id) => (document.edges[id].mismatch = true));
  const elements = elementsOf(document, { rate });
  assert.deepEqual([...elements].filter(([, data]) => data.mismatch).map(([id]) => id), apart);
  assert.deepEqual(apart.map((id) => elements.get(id).label), ["does not match", "does not match"]);
  assert.equal(elements.get("topic /t subscribes node /c").label, "5/s");
});

test("the labels of a node are below its name", () => {
  const document = graph("/a publishes /t");
  document.vertices["node /a"].labels = { origin: "ros2/7", host: "x" };
  assert.equal(elementsOf(document, { rate }).get("node /a").label, "/a\n[origin=ros2/7, host=x]");
});

test("an edge for several is marked if one of them does not match", () => {
  const document = graph("/x/a publishes /t", "/x/b publishes /t");
  document.edges["node /x/a publishes topic /t"].mismatch = true;
  const elements = elementsOf(document, { grouped: true, folded: new Set(["/x"]), rate });
  assert.equal(elements.get("group /x publishes topic /t").mismatch, true);
});

test("names of inherited members are names like all others", () => {
  const document = graph("/__proto__ publishes /constructor", "/constructor subscribes /toString");
  assert.equal(elementsOf(document, { grouped: true, rate }).size, 5);
});

test("an edge whose end is not there is not drawn", () => {
  const document = graph("/a publishes /t");
  delete document.vertices["topic /t"];
  assert.deepEqual([...elementsOf(document, { rate }).keys()], ["node /a"]);
});

test("names at the top are in the namespace /", () => {
  assert.deepEqual(["/a", "/x/a", "/x/y/a"].map(namespaceOf), ["/", "/x", "/x/y"]);
});

test("newcomers get places of their own near their neighbours; all others stay", () => {
  const elements = elementsOf(CHAIN, { rate });
  const positions = new Map([["node /a", { x: 0, y: 0 }], ["node /c", { x: 1000, y: 0 }]]);
  placeNear(["topic /t", "node /b", "topic /u"], elements, positions);
  assert.deepEqual(positions.get("node /a"), { x: 0, y: 0 });
  assert.equal(new Set([...positions.values()].map(({ x, y }) => `${x} ${y}`)).size, 5);
  assert.ok(Math.abs(positions.get("topic /t").x) <= 200);
});
