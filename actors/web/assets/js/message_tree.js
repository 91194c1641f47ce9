// @ts-check
// A message as a tree of fields. While messages have the same fields, only texts change, so that a click on a button
// never misses; groups stay folded from one message to the next.

import { h, setText } from "./dom.js";

/** Elements of a long sequence that are shown. */
const SHOWN = 64;

/** Shows one message, and updates it with the next one. */
export class MessageTree {
  /** @param {(path: string) => Node | null} [extra] returns what is shown beside a number, such as a button */
  constructor(extra = () => null) {
    this._extra = extra;
    /** @type {Set<string>} */
    this._folded = new Set();
    /** @type {Map<string, HTMLElement>} the elements of values by path */
    this._valueElements = new Map();
    this.element = h("div", { class: "tree mono" });
  }

  /** @param {unknown} message */
  show(message) {
    const texts = new Map(textsOf(message, ""));
    if (texts.size === this._valueElements.size && [...texts.keys()].every((path) => this._valueElements.has(path))) {
      this._valueElements.forEach((element, path) => setText(element, /** @type {string} */ (texts.get(path))));
      return;
    }
    this._valueElements.clear();
    this.element.replaceChildren(...this._fields(message, ""));
  }

  /**
   * @param {unknown} value
   * @param {string} path
   * @returns {Node[]}
   */
  _fields(value, path) {
    if (isPlain(value)) {
      return [this._text(value, path)];
    }
    return partsOf(/** @type {object} */ (value), path).map(([name, part, partPath]) => this._field(name, part, partPath));
  }

  /**
   * @param {string} name
   * @param {unknown} value
   * @param {string} path
   */
  _field(name, value, path) {
    if (isPlain(value)) {
      const number = typeof value === "number" ? path : Array.isArray(value) && typeof value[0] === "number" ? `${path}[0]` : "";
      return h("div", {}, h("span", { class: "dim" }, `${name}: `), this._text(value, path), number ? this._extra(number) : null);
    }
    const details = h("details", { open: !this._folded.has(path) }, h("summary", {}, name));
    details.append(h("div", { class: "fields" }, ...this._fields(value, path)));
    details.addEventListener("toggle", () => (details.open ? this._folded.delete(path) : this._folded.add(path)));
    return details;
  }

  /**
   * @param {unknown} value
   * @param {string} path
   */
  _text(value, path) {
    const element = h("span", {}, textOf(value));
    this._valueElements.set(path, element);
    return element;
  }
}

/**
 * Return the texts of a message by their paths.
 *
 * @param {unknown} value
 * @param {string} path
 * @returns {[string, string][]}
 */
function textsOf(value, path) {
  if (isPlain(value)) {
    return [[path, textOf(value)]];
  }
  return partsOf(/** @type {object} */ (value), path).flatMap(([, part, partPath]) => textsOf(part, partPath));
}

/**
 * Return the parts of a group: name, value and path each.
 *
 * @param {object} value
 * @param {string} path
 * @returns {[string, unknown, string][]}
 */
function partsOf(value, path) {
  if (Array.isArray(value)) {
    /** @type {[string, unknown, string][]} */
    const items = value.slice(0, SHOWN).map((item, number) => [`[${number}]`, item, `${path}[${number}]`]);
    return value.length > SHOWN ? [...items, ["…", `${value.length - SHOWN} more`, `${path}[…]`]] : items;
  }
  return Object.entries(value).map(([name, item]) => [name, item, path ? `${path}.${name}` : name]);
}

/**
 * Return whether a value stands in one line: a number, a text, an empty group, or a sequence of numbers or texts.
 *
 * @param {unknown} value
 */
function isPlain(value) {
  if (typeof value !== "object" || value === null) {
    return true;
  }
  return Array.isArray(value) ? value.every((item) => typeof item !== "object") : !Object.keys(value).length;
}

/** @param {unknown} value */
function textOf(value) {
  if (Array.isArray(value)) {
    const more = value.length > SHOWN ? `, … ${value.length - SHOWN} more` : "";
    return `[${value.slice(0, SHOWN).join(", ")}${more}]`;
  }
  return typeof value === "object" && value !== null ? "{}" : String(value);
}
