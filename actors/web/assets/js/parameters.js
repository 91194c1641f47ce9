// @ts-check
// The parameters of a node, each with a field of its type.

import { pathOf, request } from "./api.js";
import { announce, h, setText } from "./dom.js";
import { parseExact } from "./exact_json.js";

/**
 * What a node says of a parameter.
 * @typedef {object} Parameter
 * @property {string} name
 * @property {string} type such as "double"
 * @property {any} value integers beyond 2^53, NaN and infinities are texts
 * @property {string} description
 * @property {string} additional_constraints
 * @property {boolean} read_only
 * @property {boolean} dynamic_typing
 * @property {{from_value: any, to_value: any, step: any} | undefined} range
 */

/**
 * Return a value as the text of its field.
 *
 * @param {string} type
 * @param {any} value
 */
export function textOf(type, value) {
  if (value === undefined || value === null) {
    return "";
  }
  if (type === "integer array") {
    return `[${value.join(",")}]`;
  }
  return type === "string" || typeof value !== "object" ? String(value) : JSON.stringify(value);
}

/**
 * Return the value of a field's text as the API takes it; numbers remain texts, which are exact.
 *
 * @param {string} type
 * @param {string} text
 * @throws {SyntaxError} it is no JSON where JSON is needed
 */
export function valueOf(type, text) {
  if (type === "string" || type === "integer" || type === "double") {
    return text;
  }
  return parseExact(text);
}

/** @param {Parameter} parameter */
export function hintOf({ type, read_only: readOnly, dynamic_typing: dynamic, range, additional_constraints: more }) {
  const parts = [dynamic ? `${type}, or another type` : type];
  if (range) {
    parts.push(`from ${range.from_value} to ${range.to_value}${range.step ? ` in steps of ${range.step}` : ""}`);
  }
  if (more) {
    parts.push(more);
  }
  if (readOnly) {
    parts.push("read-only");
  }
  return parts.join("; ");
}

let made = 0;

/** One parameter: its field follows the node, unless somebody is editing it. */
class Row {
  /**
   * @param {Parameters} owner
   * @param {Parameter} parameter
   */
  constructor(owner, parameter) {
    this._owner = owner;
    this.parameter = parameter;
    this.key = keyOf(parameter);
    const id = `parameter-${(made += 1)}`;
    const fixed = parameter.read_only || !owner.control;
    this._field = fieldOf(parameter, { id, disabled: fixed, "aria-describedby": `${id}-hint ${id}-result`, oninput: () => this._edited() });
    this._set = h("button", { type: "submit", hidden: fixed, disabled: true }, "Set");
    this._reset = h("button", { type: "button", hidden: true, onclick: () => this.reset() }, "Undo");
    this._hint = h("span", { class: "dim", id: `${id}-hint` }, hintOf(parameter));
    this._result = h("span", { id: `${id}-result` });
    this.element = h(
      "form",
      {
        class: "parameter",
        onsubmit: (/** @type {Event} */ event) => {
          event.preventDefault();
          if (this.edited) {
            owner.set([this], false);
          }
        },
      },
      h("label", { for: id, class: "mono" }, parameter.name),
      h("span", { class: "parameter-field" }, this._field, this._set, this._reset),
      h("span", { class: "parameter-text" }, this._hint, " ", h("span", {}, parameter.description), " ", this._result),
    );
    this.reset();
  }

  /** Whether somebody is editing it. */
  get edited() {
    return this.text !== this._shown;
  }

  /** Whether the field has a value that may be sent; the browser says why not. */
  get valid() {
    return this.element.reportValidity();
  }

  get wanted() {
    const { name, type } = this.parameter;
    const value = this._field.type === "checkbox" ? /** @type {HTMLInputElement} */ (this._field).checked : valueOf(type, this.text);
    return type === "not set" ? { name, value } : { name, type, value };
  }

  /** @param {Parameter} parameter as it is now */
  update(parameter) {
    const before = textOf(this.parameter.type, this.parameter.value);
    this.parameter = parameter;
    const now = textOf(parameter.type, parameter.value);
    if (now === before) {
      return;
    }
    if (this.edited && now !== this.text) {
      this.say(`It has become ${now} meanwhile`, "warn");
    } else {
      this.reset();
    }
  }

  /** @param {Row} old the same parameter with a field of another kind */
  replace(old) {
    this.say(old._result.textContent ?? "", old._result.className);
    const focused = old.element.contains(document.activeElement);
    old.element.replaceWith(this.element);
    if (focused) {
      this._field.focus();
    }
  }

  /**
   * Take over the value that the node has accepted; what was written after it was sent remains.
   *
   * @param {any} value
   * @param {string} sent its text
   */
  take(value, sent) {
    this.parameter = { ...this.parameter, value };
    if (this.text === sent) {
      this.reset();
    } else {
      this._shown = sent;
      this._edited();
    }
  }

  /** Show the node's value. */
  reset() {
    const { type, value } = this.parameter;
    this._shown = textOf(type, value);
    if (this._field.type === "checkbox") {
      /** @type {HTMLInputElement} */ (this._field).checked = value === true;
    } else {
      this._field.value = this._shown;
      this._shown = this._field.value; // line ends become "\n"
    }
    this._edited();
  }

  /**
   * @param {string} text
   * @param {string} style
   */
  say(text, style) {
    this._result.className = style;
    setText(this._result, text);
  }

  /** What is in the field. */
  get text() {
    return this._field.type === "checkbox" ? String(/** @type {HTMLInputElement} */ (this._field).checked) : this._field.value;
  }

  _edited() {
    this._set.disabled = !this.edited;
    this._reset.hidden = !this.edited;
    this._owner.changed();
  }
}

/**
 * @param {Parameter} parameter
 * @param {Record<string, unknown>} attributes
 * @returns {HTMLInputElement | HTMLTextAreaElement}
 */
function fieldOf({ type, value, range }, attributes) {
  if (type === "boolean") {
    return h("input", { ...attributes, type: "checkbox" });
  }
  if ((type === "integer" || type === "double") && typeof value === "number") {
    const limits = range ? { min: range.from_value, max: range.to_value } : {};
    const step = type === "double" ? "any" : range?.step || 1;
    return h("input", { ...attributes, ...limits, type: "number", step, required: true });
  }
  if (type === "string" && String(value).includes("\n")) {
    return h("textarea", { ...attributes, rows: 4 });
  }
  return h("input", { ...attributes, type: "text", spellcheck: "false", autocomplete: "off" });
}

export class Parameters {
  /**
   * @param {string} node its full name
   * @param {{control: boolean, refusal: string}} context whether they may be set, and why not
   */
  constructor(node, { control, refusal }) {
    this.control = control;
    this._node = node;
    /** @type {Map<string, Row>} */
    this._rows = new Map();
    this._error = h("p", { class: "bad" });
    this._list = h("div", { class: "parameters" });
    this._together = h("button", { type: "button", hidden: true, onclick: () => this.set(this._editedRows(), true) }, "Set all changes, or none");
    this._result = h("p");
    const readOnly = h("p", { class: "dim" }, control ? null : refusal);
    this.element = h("section", { hidden: true }, h("h3", {}, "Parameters"), readOnly, this._error, this._list, this._together, this._result);
  }

  /**
   * @param {{by_name: Record<string, Parameter>, omitted: number} | undefined} parameters undefined if the node has none
   * @param {string} [error] why they may be old
   */
  show(parameters, error = "") {
    this.element.hidden = !parameters && !error;
    const omitted = parameters?.omitted ? `${parameters.omitted} more parameters are not shown. ` : "";
    setText(this._error, `${omitted}${error}`);
    const found = parameters?.by_name ?? Object.create(null);
    for (const [name, row] of this._rows) {
      if (!Object.hasOwn(found, name)) {
        row.element.remove();
        this._rows.delete(name);
      }
    }
    let before = null;
    for (const name of Object.keys(found).sort()) {
      const old = this._rows.get(name);
      const row = old && keyOf(found[name]) === old.key ? old : new Row(this, { ...found[name] });
      this._rows.set(name, row);
      if (row === old) {
        row.update({ ...found[name] });
      } else if (old) {
        row.replace(old);
      }
      const next = /** @type {Element | null} */ (before ? before.nextSibling : this._list.firstChild);
      if (row.element !== next) {
        this._list.insertBefore(row.element, next);
      }
      before = row.element;
    }
    this.changed();
  }

  /** Offer to set all changes together if there are several. */
  changed() {
    this._together.hidden = this._editedRows().length < 2;
  }

  /**
   * Set what has been edited, and say for each how it went.
   *
   * @param {Row[]} rows
   * @param {boolean} atomic all or none
   */
  async set(rows, atomic) {
    if (!rows.every((row) => row.valid)) {
      return;
    }
    /** @type {any[]} */
    let results;
    const sent = rows.map((row) => row.text);
    /** @type {any[]} */
    let parameters = [];
    try {
      parameters = rows.map((row) => row.wanted);
      const answer = await request("PATCH", pathOf("nodes", this._node, "/parameters"), { parameters, atomic });
      results = atomic ? rows.map(() => answer) : answer;
    } catch (error) {
      const reason = error instanceof SyntaxError ? `This is not JSON: ${error.message}` : /** @type {Error} */ (error).message;
      results = rows.map(() => ({ successful: false, reason }));
    }
    rows.forEach((row, number) => {
      const { successful, reason } = results[number];
      const text = successful ? `Set to ${sent[number]}` : `Not set: ${reason || "the node gives no reason"}`;
      if (successful) {
        row.take(parameters[number].value, sent[number]);
      }
      row.say(text, successful ? "good" : "bad");
      announce(`${row.parameter.name}: ${text}`);
    });
    if (atomic) {
      const { successful, reason } = results[0];
      this._result.className = `notice ${successful ? "good" : "bad"}`;
      setText(this._result, successful ? `${rows.length} parameters were set together` : `None was set: ${reason}`);
    }
  }

  _editedRows() {
    return [...this._rows.values()].filter((row) => row.edited);
  }
}

/**
 * Return what the kind of a parameter's field depends on; the value itself does not.
 *
 * @param {Parameter} parameter
 */
function keyOf(parameter) {
  return JSON.stringify({ ...parameter, value: typeof parameter.value });
}
