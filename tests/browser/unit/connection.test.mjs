import assert from "node:assert/strict";
import { test } from "node:test";

import { applyPatch } from "../js/connection.js";

/** Return a document, without a prototype as the page makes it, after a patch that came as JSON. */
function patched(document, patch) {
  const target = Object.assign(Object.create(null), document);
  applyPatch(target, JSON.parse(patch));
  return target;
}

// The examples of RFC 7396 whose document and patch are objects.
for (const [document, patch, expected] of [
  [{ a: "b" }, '{"a":"c"}', { a: "c" }],
  [{ a: "b" }, '{"b":"c"}', { a: "b", b: "c" }],
  [{ a: "b" }, '{"a":null}', {}],
  [{ a: "b", b: "c" }, '{"a":null}', { b: "c" }],
  [{ a: ["b"] }, '{"a":"c"}', { a: "c" }],
  [{ a: "c" }, '{"a":["b"]}', { a: ["b"] }],
  [{ a: { b: "c" } }, '{"a":{"b":"d","c":null}}', { a: { b: "d" } }],
  [{ a: [{ b: "c" }] }, '{"a":[1]}', { a: [1] }],
  [{ e: null }, '{"a":1}', { e: null, a: 1 }],
  [{}, '{"a":{"bb":{"ccc":null}}}', { a: { bb: {} } }],
  [{ a: [1, 2] }, '{"a":{"b":1}}', { a: { b: 1 } }],
]) {
  test(`${JSON.stringify(document)} with ${patch}`, () => {
    assert.equal(JSON.stringify(patched(document, patch)), JSON.stringify(expected));
  });
}

test("names of an object's inherited members are members like all others", () => {
  const patch = '{"__proto__":{"polluted":1},"constructor":{"prototype":{"polluted":1}},"toString":2,"nodes":{"__proto__":3}}';
  const found = patched({}, patch);
  assert.equal(JSON.stringify(found), patch);
  assert.equal(Object.getPrototypeOf(found), null);
  assert.equal({}.polluted, undefined);
  applyPatch(found, JSON.parse('{"__proto__":{"polluted":null,"other":[1]},"constructor":null,"toString":null,"nodes":null}'));
  assert.equal(JSON.stringify(found), '{"__proto__":{"other":[1]}}');
});

test("only what is patched gets another identity", () => {
  const found = patched({ topics: { "/a": { rate: 1 } }, nodes: {} }, "{}");
  const { topics, nodes } = found;
  applyPatch(found, { topics: { "/a": { rate: 2 } } });
  assert.equal(found.topics, topics);
  assert.equal(found.nodes, nodes);
  assert.equal(topics["/a"].rate, 2);
});
