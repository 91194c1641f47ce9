// @ts-check
// A choice between the types of a topic, service or action that has several because programs disagree.

import { h } from "./dom.js";

/** Shows nothing while there is one type. */
export class TypeChoice {
  /** @param {() => void} onChange called when another type is chosen */
  constructor(onChange) {
    /** @type {string[]} */
    this._types = [];
    this._select = h("select", { onchange: onChange });
    this.element = h("label", { hidden: true }, "Type ", this._select);
  }

  /** The chosen type; empty for any. */
  get value() {
    return this.element.hidden ? "" : this._select.value;
  }

  /**
   * Show the types; what is chosen remains if it is among them.
   *
   * @param {string[]} types
   */
  show(types) {
    if (types.join() === this._types.join()) {
      return;
    }
    const chosen = this._select.value;
    this._types = types;
    this._select.replaceChildren(h("option", { value: "" }, "any"), ...types.map((type) => h("option", { value: type }, type)));
    this._select.value = types.includes(chosen) ? chosen : "";
    this.element.hidden = types.length < 2;
    if (this._select.value !== chosen) {
      this._select.dispatchEvent(new Event("change"));
    }
  }
}

/**
 * Return a query for a type, to be put behind a path.
 *
 * @param {string} type empty for any
 */
export function typeQuery(type) {
  return type ? `?type=${encodeURIComponent(type)}` : "";
}
