import assert from "node:assert/strict";
import { test } from "node:test";

import { ValueError, initialOf, valueOf, valuesOf } from "../js/form_values.js";

const INT64 = { name: "a", type: "int64", kind: "integer", minimum: -(2n ** 63n), maximum: 2n ** 63n - 1n };
const BYTE = { name: "b", type: "uint8", kind: "integer", minimum: 0, maximum: 255 };
const DOUBLE = { name: "d", type: "float64", kind: "number" };
const FLAG = { name: "f", type: "boolean", kind: "boolean" };
const TEXT = { name: "t", type: "string<=3", kind: "text", max_length: 3 };

test("integers within their limits, decimal or hexadecimal, exact beyond 2^53", () => {
  for (const [text, value] of [["5", 5], [" +7 ", 7], ["-0x10", -16], ["9223372036854775807", 2n ** 63n - 1n]]) {
    assert.equal(valueOf(INT64, text), value);
  }
});

test("what is no integer or beyond the limits is refused with them", () => {
  for (const text of ["", "1.5", "1e3", "256", "-1", "0b1", "12n", "٣"]) {
    assert.throws(() => valueOf(BYTE, text), new ValueError("an integer from 0 to 255"), text);
  }
  assert.throws(() => valueOf(INT64, "9223372036854775808"), ValueError);
});

test("numbers are numbers, or the texts nan and inf", () => {
  assert.equal(valueOf(DOUBLE, " -1.5e3 "), -1500);
  for (const text of ["nan", "-inf", "Infinity"]) {
    assert.equal(valueOf(DOUBLE, text), text);
  }
  for (const text of ["", "1,5", "one", "1e999"]) {
    assert.throws(() => valueOf(DOUBLE, text), ValueError, text);
  }
});

test("texts stay as they are, and have a limit in characters", () => {
  assert.equal(valueOf(TEXT, " x "), " x ");
  assert.equal(valueOf(TEXT, "😀😀😀"), "😀😀😀");
  assert.throws(() => valueOf(TEXT, "four"), new ValueError("at most 3 characters"));
});

test("sequences are separated by commas, spaces or lines, and have their length", () => {
  const pair = { ...BYTE, array: { low: 2, high: 2 } };
  assert.deepEqual(valuesOf(pair, "[1, 2]"), [1, 2]);
  assert.deepEqual(valuesOf({ ...BYTE, array: { low: 0, high: null } }, "1\n2;3 4"), [1, 2, 3, 4]);
  assert.throws(() => valuesOf(pair, "1"), new ValueError("2 elements, not 1"));
  assert.throws(() => valuesOf({ ...BYTE, array: { low: 0, high: 1 } }, "1 2"), new ValueError("0 to 1 elements, not 2"));
});

test("new fields have their default, or nothing of their kind", () => {
  assert.equal(initialOf({ ...BYTE, default: 7 }), 7);
  assert.deepEqual([INT64, DOUBLE, FLAG, TEXT].map(initialOf), [0, 0, false, ""]);
  assert.deepEqual(initialOf({ name: "m", type: "M[2]", kind: "message", array: { low: 2, high: 2 } }), [{}, {}]);
});
