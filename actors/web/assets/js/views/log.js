// @ts-check
// The log of all nodes.

import { h } from "../dom.js";
import { LogList } from "../log_list.js";

/** @typedef {import("../main.js").Context} Context */

/**
 * @param {HTMLElement} container
 * @param {Context} context
 * @returns {() => void}
 */
export function show(container, context) {
  const list = new LogList(context.connection);
  container.append(h("div", { class: "whole-log" }, h("h2", {}, "Log"), list.element));
  return () => list.close();
}
