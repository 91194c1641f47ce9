// @ts-check
// One node: where it runs, its state, parameters, endpoints and log.

import { h, setText } from "../dom.js";
import { bytes, duration, labelsText, qosText, short } from "../format.js";
import { Lifecycle } from "../lifecycle.js";
import { LogList } from "../log_list.js";
import { Parameters } from "../parameters.js";
import { addressOf } from "../routes.js";
import { Table } from "../table.js";
import { stateText } from "./nodes.js";

/** @typedef {import("../main.js").Context} Context */

const STANDARD =
  /^\/(rosout|parameter_events|clock)$|\/(describe_parameters|get_parameter_types|get_parameters|list_parameters|set_parameters|set_parameters_atomically|get_type_description|get_diagnostics|get_logger_levels|set_logger_levels)$/;

/**
 * @param {HTMLElement} container
 * @param {Context} context
 * @returns {() => void}
 */
export function show(container, context) {
  const { connection, name } = context;
  const summary = h("div");
  const badge = h("span", { class: "badge" });
  const process = new Process();
  const lifecycle = new Lifecycle(name, context);
  const lifecycleError = h("p", { class: "bad" });
  const parameters = new Parameters(name, context);
  const endpoints = new Table("Endpoints", [
    { title: "Name", value: (row) => row.name, href: (row) => addressOf(viewOf(row), row.name) },
    { title: "Kind", value: (row) => row.kind },
    { title: "Type", value: (row) => row.type },
    { title: "QoS", value: (row) => (isOfTopic(row) ? qosText(row.qos) : "") },
  ]);
  const standard = h("input", { type: "checkbox", onchange: () => drawEndpoints() });
  /** @type {Record<string, any>} */
  let found = {};
  const drawEndpoints = () => {
    const rows = Object.entries(found.endpoints ?? {}).filter(([, row]) => standard.checked || !STANDARD.test(row.name));
    endpoints.show(Object.fromEntries(rows));
  };
  const log = new LogList(connection, name);
  container.append(
    h("h2", {}, name, badge),
    summary,
    lifecycle.element,
    lifecycleError,
    process.element,
    parameters.element,
    h("section", {}, h("h3", {}, "Endpoints"), h("div", { class: "toolbar" }, h("label", {}, standard, "Those that every node has")), endpoints.element),
    h("section", {}, h("h3", {}, "Log"), log.element),
  );
  const close = connection.open("node", { node: name }, ({ document, body }) => {
    if (body.error) {
      summary.replaceChildren(h("p", { class: "notice bad" }, body.error));
      return;
    }
    found = document;
    const errors = document.errors ?? {};
    setText(badge, labelsText(document.labels));
    showLines(summary, linesOf(document));
    process.show(document.diagnostics, errors.diagnostics);
    lifecycle.show(document.lifecycle);
    setText(lifecycleError, errors.lifecycle ?? "");
    parameters.show(document.parameters, errors.parameters);
    drawEndpoints();
  });
  return () => {
    close();
    log.close();
  };
}

/** @param {any} endpoint */
function isOfTopic({ kind }) {
  return kind === "publisher" || kind === "subscription";
}

/** @param {any} endpoint */
function viewOf(endpoint) {
  return isOfTopic(endpoint) ? "topic" : "service";
}

/**
 * @param {Record<string, any>} node
 * @returns {[text: string, style: string][]}
 */
function linesOf({ exists, duplicate, links }) {
  const rows = Object.values(links ?? {});
  /** @type {[text: string, style: string][]} */
  const lines = rows.map((row) => [
    [
      `${stateText(row)}${row.broker ? ` at ${row.broker}` : ""}`,
      `receives ${bytes(row.received_bytes_per_sec)}/s, sends ${bytes(row.sent_bytes_per_sec)}/s`,
      `${short(row.queued)} queued, ${short(row.dropped)} dropped`,
      `${short(row.pending_calls)} calls wait for a response, ${short(row.owed_calls)} to be answered`,
    ].join(" · "),
    row.state === "linked" ? "" : "bad",
  ]);
  if (!exists && !lines.length) {
    lines.push(["There is no such node now.", "notice bad"]);
  }
  if (duplicate) {
    lines.push(["Nodes of several brokers have this name, although not all of them share it.", "notice bad"]);
  }
  return lines;
}

/**
 * @param {HTMLElement} container
 * @param {[text: string, style: string][]} lines
 */
function showLines(container, lines) {
  while (container.children.length > lines.length) {
    container.lastElementChild?.remove();
  }
  lines.forEach(([text, style], number) => {
    const line = container.children[number] ?? container.appendChild(h("p"));
    line.className = style;
    setText(line, text);
  });
}

/** Where a node runs, and what its callbacks take. */
class Process {
  constructor() {
    /** @type {any} */
    this._before = null;
    this._facts = h("p");
    this._error = h("p", { class: "bad" });
    this._more = h("p", { class: "dim" });
    this._callbacks = new Table("Callbacks", [
      { title: "Busy", value: (row) => row.busy_sec, text: (row) => duration(row.busy_sec), number: true },
      { title: "Now", value: (row) => row.share, text: (row) => (row.share === undefined ? "-" : `${(100 * row.share).toFixed(1)} %`), number: true },
      { title: "Callback", value: (row) => row.name },
      { title: "Of", value: (row) => `${row.kind} ${row.source}`.trim() },
      { title: "Calls", value: (row) => row.calls, text: (row) => short(row.calls), number: true },
      { title: "Longest", value: (row) => row.longest_sec, text: (row) => duration(row.longest_sec), number: true },
      { title: "Slow", value: (row) => row.slow, style: (row) => (row.slow ? "warn" : ""), number: true },
    ]);
    this.element = h("section", { hidden: true }, h("h3", {}, "Process"), this._facts, this._error, h("details", { open: true }, h("summary", {}, "Callbacks"), this._callbacks.element, this._more));
  }

  /**
   * @param {any} found undefined if the node does not serve them
   * @param {string} [error] why it is old
   */
  show(found, error = "") {
    this.element.hidden = !found && !error;
    setText(this._error, error);
    if (!found || found.stamp_ns === this._before?.stamp_ns) {
      return;
    }
    const lag = `loop delay ${duration(found.loop_lag_sec)}, longest ${duration(found.longest_loop_lag_sec)}`;
    const parts = [`process ${found.pid}`, `up for ${duration(found.uptime_sec)}`, lag];
    if (found.connections > 1) {
      parts.push(`connected ${found.connections} times`);
    }
    parts.push(`${short(found.callback_errors)} callbacks raised`, `host ${found.host}`); // last: a name from right to left cannot change the order of the others
    setText(this._facts, parts.join(" · "));
    const rows = byKey(found.callbacks);
    const seconds = this._before ? found.uptime_sec - this._before.uptime_sec : 0;
    for (const [key, row] of Object.entries(rows)) {
      const before = this._before?.rows[key];
      row.share = seconds > 0 ? (row.busy_sec - (before?.busy_sec ?? 0)) / seconds : undefined;
    }
    this._callbacks.show(rows);
    setText(this._more, found.omitted_callbacks ? `and ${found.omitted_callbacks} more` : "");
    this._before = { stamp_ns: found.stamp_ns, uptime_sec: found.uptime_sec, rows };
  }
}

/**
 * Return callbacks by a key that stays.
 *
 * @param {any[]} callbacks
 * @returns {Record<string, any>}
 */
function byKey(callbacks) {
  /** @type {Record<string, any>} */
  const rows = {};
  for (const each of callbacks) {
    let key = `${each.kind} ${each.source} ${each.name}`;
    while (Object.hasOwn(rows, key)) {
      key += "'"; // timers may have the same callback
    }
    rows[key] = { ...each };
  }
  return rows;
}
