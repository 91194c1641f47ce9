// @ts-check
// All nodes with their links and traffic.

import { h } from "../dom.js";
import { bytes, labelsText, short } from "../format.js";
import { isHidden } from "../names.js";
import { addressOf } from "../routes.js";
import { Table } from "../table.js";

/** @typedef {import("../main.js").Context} Context */

/**
 * @param {boolean} mesh whether to show brokers
 * @returns {Table<any>}
 */
function makeTable(mesh) {
  return new Table("Nodes", [
    { title: "Node", value: (row) => row.name, href: (row) => addressOf("node", row.name), badge: (row) => labelsText(row.labels) },
    ...(mesh ? [{ title: "Broker", value: (/** @type {any} */ row) => row.broker }] : []),
    { title: "State", value: stateText, style: (row) => (row.state === "linked" && !row.duplicate ? "" : "bad") },
    { title: "Endpoints", value: (row) => row.endpoints, number: true },
    { title: "Receives/s", value: (row) => row.received_bytes_per_sec, text: (row) => bytes(row.received_bytes_per_sec), number: true },
    { title: "Sends/s", value: (row) => row.sent_bytes_per_sec, text: (row) => bytes(row.sent_bytes_per_sec), number: true },
    { title: "Queued", value: (row) => row.queued, text: (row) => short(row.queued), number: true },
    { title: "Dropped", value: (row) => row.dropped, text: (row) => short(row.dropped), style: (row) => (row.drops_per_sec ? "bad" : ""), number: true },
  ]);
}

/** @param {any} row of a node */
export function stateText(row) {
  const silent = row.state === "suspended" ? ` (silent for ${(row.silent_ms / 1000).toFixed(1)} s)` : "";
  return `${row.state}${silent}${row.duplicate ? ", duplicate name" : row.shared ? ", shared name" : ""}`;
}

/**
 * @param {HTMLElement} container
 * @param {Context} context
 * @returns {() => void}
 */
export function show(container, context) {
  let mesh = false;
  let table = makeTable(mesh);
  const filter = h("input", { type: "search", placeholder: "Part of a name or label", "aria-label": "Filter", oninput: () => draw() });
  const hidden = h("input", { type: "checkbox", onchange: () => draw() });
  /** @type {Record<string, any>} */
  let nodes = {};
  const draw = () => {
    const rows = Object.entries(nodes).filter(
      ([, row]) => (hidden.checked || !isHidden(row.name)) && `${row.name} ${labelsText(row.labels)}`.includes(filter.value),
    );
    if (mesh !== rows.some(([, row]) => row.broker)) {
      mesh = !mesh;
      const old = table.element;
      table = makeTable(mesh);
      old.replaceWith(table.element);
    }
    table.show(Object.fromEntries(rows));
  };
  container.append(h("h2", {}, "Nodes"), h("div", { class: "toolbar" }, filter, h("label", {}, hidden, "Hidden")), table.element);
  return context.connection.open("overview", {}, ({ document }) => {
    nodes = document.nodes ?? {};
    draw();
  });
}
