import assert from "node:assert/strict";
import { test } from "node:test";

import { parseExact, stringifyExact } from "../js/exact_json.js";

let tellsDigits = false;
JSON.parse("1", (_key, value, context) => {
  tellsDigits = context?.source === "1";
  return value;
});

test("integers of 64 bits remain exact on their way back", { skip: !tellsDigits && "this Node.js does not tell digits" }, () => {
  const text = '{"a":18446744073709551615,"b":[-9223372036854775808,1],"c":9007199254740991}';
  const value = parseExact(text);
  assert.equal(value.a, 18446744073709551615n);
  assert.equal(value.c, 9007199254740991);
  assert.equal(stringifyExact(value), text);
});

test("fractions and great floats stay numbers", () => {
  assert.deepEqual(parseExact("[1.5,1e300,-0.25]"), [1.5, 1e300, -0.25]);
});

test("values are written as JSON writes them", () => {
  for (const value of [null, true, "a\"\u2028\ud800", 1.5, [], {}, [[], {}], { a: [1, { b: null }], "é": "x" }]) {
    assert.equal(stringifyExact(value), JSON.stringify(value));
    assert.equal(stringifyExact(value, "  "), JSON.stringify(value, null, 2));
  }
});

test("big integers are digits, undefined members are left out, and what is no JSON is null", () => {
  assert.equal(stringifyExact({ a: 2n ** 63n, b: undefined, c: NaN, d: [undefined] }), '{"a":9223372036854775808,"c":null,"d":[null]}');
});

test("a member named __proto__ stays a member", () => {
  const text = '{"__proto__":{"a":1},"constructor":2}';
  assert.equal(stringifyExact(parseExact(text)), text);
});
