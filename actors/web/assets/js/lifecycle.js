// @ts-check
// The state of a node, with a button for each transition that is possible.

import { pathOf, request } from "./api.js";
import { announce, h, setText } from "./dom.js";

export class Lifecycle {
  /**
   * @param {string} node its full name
   * @param {{control: boolean, refusal: string}} context whether the buttons work, and why not
   */
  constructor(node, { control, refusal }) {
    this._node = node;
    this._control = control;
    this._shown = "";
    this._running = false;
    this._state = h("strong");
    this._buttons = h("span", { class: "toolbar" });
    this._result = h("p");
    this.element = h("section", { hidden: true }, h("h3", {}, "Lifecycle"), h("p", {}, "State: ", this._state), this._buttons, h("p", { class: "dim" }, control ? null : refusal), this._result);
  }

  /** @param {any} lifecycle state and transitions; undefined if the node has none */
  show(lifecycle) {
    this.element.hidden = !lifecycle;
    if (!lifecycle) {
      return;
    }
    setText(this._state, lifecycle.state.label);
    const shown = JSON.stringify(lifecycle.transitions);
    if (shown !== this._shown) {
      this._shown = shown;
      const buttons = lifecycle.transitions.map((/** @type {any} */ each) =>
        h("button", { type: "button", disabled: !this._control, onclick: () => this._request(each) }, each.label),
      );
      const focused = this._buttons.contains(document.activeElement);
      this._buttons.replaceChildren(...buttons);
      if (focused) {
        buttons[0]?.focus();
      }
    }
  }

  /** @param {any} transition */
  async _request(transition) {
    if (this._running) {
      return;
    }
    this._running = true;
    this._say(`${transition.label} …`, "dim");
    try {
      const answer = await request("POST", pathOf("nodes", this._node, "/lifecycle"), { transition: transition.id });
      this._say(`${transition.label} ${answer.success ? "succeeded" : "failed"}: the node is ${answer.state.label}`, answer.success ? "good" : "bad");
    } catch (error) {
      this._say(`${transition.label}: ${/** @type {Error} */ (error).message}`, "bad");
    }
    this._running = false;
  }

  /**
   * @param {string} text
   * @param {string} style
   */
  _say(text, style) {
    this._result.className = `notice ${style}`;
    setText(this._result, text);
    announce(text);
  }
}
