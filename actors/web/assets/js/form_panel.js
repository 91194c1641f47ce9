// @ts-check
// A form and the button that sends it: what services, actions and topics have in common.

import { request } from "./api.js";
import { announce, h, setText } from "./dom.js";
import { parseExact, stringifyExact } from "./exact_json.js";
import { Form, FormError } from "./form.js";

/** @typedef {import("./main.js").Context} Context */
/**
 * @typedef {object} Parts
 * @property {() => string} path returns that of the form
 * @property {string} title
 * @property {string} verb on the button
 * @property {(value: any) => void} send called with what has been written
 * @property {(Node | null)[]} [extras] further controls, beside the button
 */

/** Shows the form of something, or why there is none. */
export class FormPanel {
  /**
   * @param {Context} context
   * @param {Parts} parts
   */
  constructor(context, parts) {
    this._context = context;
    this._parts = parts;
    this._loaded = 0;
    this._description = "";
    /** @type {Form | null} */
    this._form = null;
    this._formArea = h("div", {}, h("p", { class: "dim" }, "Loading the form …"));
    this._button = h("button", { type: "submit", class: "primary", disabled: true }, parts.verb);
    this._notice = h("p", { class: "notice", hidden: true });
    const reason = context.control ? null : h("p", { class: "notice" }, context.refusal);
    this.element = h(
      "form",
      { novalidate: true, onsubmit: (/** @type {Event} */ event) => this._submit(event) },
      h("h3", {}, parts.title),
      reason,
      this._formArea,
      h("div", { class: "toolbar" }, this._button, ...(parts.extras ?? [])),
      this._notice,
    );
  }

  /** Get the form; again when the type may have changed. What has been written is lost if it has. */
  async load() {
    const mine = ++this._loaded;
    try {
      const { form } = await request("GET", this._parts.path(), undefined, undefined, parseExact);
      if (mine !== this._loaded) {
        return;
      }
      const description = stringifyExact(form);
      if (this._form === null || description !== this._description) {
        this._description = description;
        this._form = new Form(form);
        this._form.setDisabled(!this._context.control);
        this._formArea.replaceChildren(this._form.element);
      }
    } catch (error) {
      if (mine === this._loaded) {
        this._form = null;
        this._formArea.replaceChildren(h("p", { class: "notice bad" }, `No form: ${/** @type {Error} */ (error).message}`));
      }
    }
    this._button.disabled = this._form === null || !this._context.control;
  }

  /**
   * Say what has happened, to everybody.
   *
   * @param {string} text
   * @param {"" | "good" | "bad"} [kind]
   */
  say(text, kind = "") {
    this._notice.hidden = false;
    this._notice.className = `notice ${kind}`;
    setText(this._notice, text);
    announce(text);
  }

  /** @param {Event} event */
  _submit(event) {
    event.preventDefault();
    if (this._form === null || !this._context.control) {
      return;
    }
    try {
      this._parts.send(this._form.read());
    } catch (error) {
      if (!(error instanceof FormError)) {
        throw error;
      }
      this.say(`Not sent: ${error.message}`, "bad");
    }
  }
}
