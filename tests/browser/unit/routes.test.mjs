import assert from "node:assert/strict";
import { test } from "node:test";

import { addressOf, readAddress } from "../js/routes.js";

test("each name survives its way through an address", () => {
  for (const name of ["", "/addison", "/a/b c", "/%2F#?&", "/__proto__", "/é😀", "/\u202e<img src=x>"]) {
    assert.deepEqual(readAddress(addressOf("topic", name)), { view: "topic", name });
  }
});

test("an address that is none has no view, and one that cannot be decoded no name", () => {
  for (const hash of ["", "#", "#graph", "#//x", "#/a-b/c"]) {
    assert.deepEqual(readAddress(hash), { view: "", name: "" });
  }
  assert.deepEqual(readAddress("#/topic/%ff"), { view: "topic", name: "" });
});
