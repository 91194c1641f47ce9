import assert from "node:assert/strict";
import { test } from "node:test";

import { bytes, duration, qosText, short } from "../js/format.js";

/** Hold a function against its results for single arguments. */
function check(format, expected) {
  for (const [value, text] of expected) {
    assert.equal(format(value), text, String(value));
  }
}

test("numbers have three digits and a unit", () => {
  check(short, [
    [0, "0"], [7, "7"], [1.5, "1.50"], [12.34, "12.3"], [123.4, "123"], [1000, "1 k"], [1234, "1.23 k"], [1e6, "1 M"],
    [-1234, "-1.23 k"], [2.5e15, "2500 T"],
  ]);
});

test("a number that is rounded up gets the next unit or one digit fewer", () => {
  check(short, [[999.4, "999"], [999.7, "1.00 k"], [999_999, "1.00 M"], [9.999, "10.0"], [99.97, "100"]]);
});

test("a number that is missing is a dash", () => {
  check(short, [[null, "-"], [undefined, "-"], [NaN, "-"]]);
  check(bytes, [[null, "-"]]);
  check(duration, [[null, "-"], [undefined, "-"]]);
});

test("sizes have binary units", () => {
  check(bytes, [[0, "0 B"], [1000, "1000 B"], [1024, "1 KiB"], [1536, "1.50 KiB"], [5 * 2 ** 30, "5 GiB"]]);
});

test("durations have the unit that suits them", () => {
  check(duration, [
    [0, "0 µs"], [5e-6, "5 µs"], [0.0012, "1.2 ms"], [0.25, "250.0 ms"], [1.5, "1.5 s"], [61, "1 min"], [3600, "1 h 0 min"],
    [7384, "2 h 3 min"],
  ]);
});

test("a duration that is rounded up gets the next unit", () => {
  check(duration, [[0.0009999, "1.0 ms"], [0.99999, "1.0 s"], [59.99, "1 min"], [3599.9, "1 h 0 min"]]);
});

test("a negative duration, as clocks of two computers make it, has the unit of a positive one", () => {
  check(duration, [[-0.5, "-500.0 ms"], [-90, "-1 min"]]);
});

test("a QoS profile names what is limited", () => {
  const qos = { history: "keep_last", depth: 5, reliability: "reliable", durability: "volatile", strict: false };
  assert.equal(qosText(qos), "keep_last 5, reliable, volatile");
  const limited = { ...qos, history: "keep_all", strict: true, deadline_ns: 2e8, lifespan_ns: 0 };
  assert.equal(qosText(limited), "keep_all, reliable, volatile, strict, deadline 200.0 ms");
});
