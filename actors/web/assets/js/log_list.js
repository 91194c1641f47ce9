// @ts-check
// Lines of the log, in the order of their time: those that are kept, then new ones.

import { announce, h, setText } from "./dom.js";
import { clock } from "./format.js";
import { addressOf } from "./routes.js";

/** @typedef {import("./connection.js").Connection} Connection */

export const MAX_LINES = 2000;

const TYPING_MS = 250;
const LEVELS = ["debug", "info", "warn", "error", "fatal"];
/** @type {Record<string, string>} */
const STYLES = { DEBUG: "dim", WARN: "warn", ERROR: "bad", FATAL: "bad" };

/**
 * Return whether a line is older than another one.
 *
 * @param {any} one
 * @param {any} other
 */
function isOlder(one, other) {
  return one.stamp.sec < other.stamp.sec || (one.stamp.sec === other.stamp.sec && one.stamp.nanosec < other.stamp.nanosec);
}

/** The newest lines of all nodes, or of one, with what chooses and pauses them. */
export class LogList {
  /**
   * @param {Connection} connection
   * @param {string} [node] the full name of the only node
   */
  constructor(connection, node = "") {
    this._connection = connection;
    this._node = node;
    /** @type {any[]} */
    this._lines = [];
    /** @type {any[]} */
    this._held = [];
    this._skipped = 0;
    this._paused = false;
    this._typing = 0;
    this._end = () => {};
    const changed = () => this._reopenSoon();
    this._level = h("select", { "aria-label": "Least level", onchange: () => this._reopen() }, ...LEVELS.map((each) => h("option", { value: each }, each)));
    this._name = h("input", { type: "search", placeholder: "Part of a node's name", "aria-label": "Node", oninput: changed });
    this._text = h("input", { type: "search", placeholder: "Part of the text", "aria-label": "Text", oninput: changed });
    this._pause = h("button", { type: "button", "aria-pressed": "false", onclick: () => this._setPaused(!this._paused) }, "Pause");
    this._count = h("span", { class: "dim" });
    this._list = h("div", { class: "log mono", role: "log", "aria-live": "off", "aria-label": "Log lines", tabindex: "0" });
    this.element = h(
      "div",
      { class: "log-view" },
      h("div", { class: "toolbar" }, this._level, node ? null : this._name, this._text, this._pause, this._count),
      this._list,
    );
    this._onConnection = () => {
      if (connection.connected) {
        this._clear(); // the kept lines come again
      }
    };
    connection.addEventListener("change", this._onConnection);
    this._reopen();
  }

  close() {
    clearTimeout(this._typing);
    this._connection.removeEventListener("change", this._onConnection);
    this._end();
  }

  _reopenSoon() {
    clearTimeout(this._typing);
    this._typing = window.setTimeout(() => this._reopen(), TYPING_MS);
  }

  _reopen() {
    clearTimeout(this._typing);
    this._end();
    this._clear();
    const chosen = { level: this._level.value, node: this._node || this._name.value, text: this._text.value };
    this._end = this._connection.open("log", chosen, ({ body }) => this._take(body));
  }

  _clear() {
    this._lines = [];
    this._held = [];
    this._skipped = 0;
    this._list.replaceChildren();
    this._showCount();
  }

  /** @param {boolean} paused */
  _setPaused(paused) {
    this._paused = paused;
    this._pause.setAttribute("aria-pressed", String(paused));
    announce(paused ? "The log is paused" : "The log goes on");
    if (!paused) {
      const held = this._held;
      this._held = [];
      this._add(held);
    }
    this._showCount();
  }

  /** @param {Record<string, any>} body */
  _take(body) {
    if (body.error) {
      setText(this._count, body.error);
      return;
    }
    this._skipped += body.skipped;
    if (this._paused) {
      this._held.push(...body.lines);
      this._held.splice(0, this._held.length - MAX_LINES);
    } else {
      this._add(body.lines);
    }
    this._showCount();
  }

  /** @param {any[]} lines */
  _add(lines) {
    const list = this._list;
    const atEnd = list.scrollHeight - list.scrollTop - list.clientHeight < 8;
    for (const line of lines) {
      let index = this._lines.length;
      while (index > 0 && isOlder(line, this._lines[index - 1])) {
        index -= 1;
      }
      if (index === 0 && this._lines.length >= MAX_LINES) {
        continue; // it is older than everything that is shown
      }
      list.insertBefore(rowOf(line, this._node === ""), list.children[index] ?? null);
      this._lines.splice(index, 0, line);
      if (this._lines.length > MAX_LINES) {
        this._lines.shift();
        list.firstElementChild?.remove();
      }
    }
    if (atEnd) {
      list.scrollTop = list.scrollHeight;
    }
  }

  _showCount() {
    const parts = [`${this._lines.length} lines`];
    if (this._paused) {
      parts.push(`${this._held.length} more wait`);
    }
    if (this._skipped) {
      parts.push(`${this._skipped} skipped`);
    }
    setText(this._count, parts.join(", "));
  }
}

/**
 * @param {any} line
 * @param {boolean} linked whether its name leads to the node
 */
function rowOf(line, linked) {
  const { sec, nanosec } = line.stamp;
  return h(
    "div",
    { class: "log-line", title: `${line.function}() at ${line.file}:${line.line}` },
    h("span", { class: "dim" }, clock(sec * 1e9 + nanosec)),
    " ",
    h("span", { class: STYLES[line.severity] }, line.severity),
    " ",
    linked ? h("a", { href: addressOf("node", line.node) }, line.name) : h("span", { class: "dim" }, line.name),
    " ",
    h("span", { class: STYLES[line.severity] }, line.msg),
  );
}
