// @ts-check
// All actions: their types, servers, clients and requests that wait.

import { h } from "../dom.js";
import { addressOf } from "../routes.js";
import { actionsAmong, isHidden } from "../names.js";
import { Table } from "../table.js";

/** @typedef {import("../main.js").Context} Context */
/** @typedef {import("../names.js").Row} Row */

/**
 * @param {HTMLElement} container
 * @param {Context} context
 * @returns {() => void}
 */
export function show(container, context) {
  const table = new Table("Actions", /** @type {import("../table.js").Column<Row>[]} */ ([
    { title: "Action", value: (row) => row.name, href: (row) => addressOf("action", row.name) },
    { title: "Type", value: (row) => row.types.join(", "), style: (row) => (row.types.length > 1 ? "bad" : "") },
    { title: "Servers", value: (row) => row.servers, style: (row) => (row.servers ? "" : "warn"), number: true },
    { title: "Clients", value: (row) => row.clients, number: true },
    { title: "Pending calls", value: (row) => row.owed_calls, number: true },
  ]));
  const filter = h("input", { type: "search", placeholder: "Part of a name or type", "aria-label": "Filter", oninput: () => draw() });
  const hidden = h("input", { type: "checkbox", onchange: () => draw() });
  /** @type {Record<string, Row>} */
  let actions = {};
  const draw = () => {
    const shown = Object.entries(actions).filter(
      ([name, row]) => (hidden.checked || !isHidden(name)) && [name, ...row.types].some((text) => text.includes(filter.value)),
    );
    table.show(Object.fromEntries(shown));
  };
  container.append(h("h2", {}, "Actions"), h("div", { class: "toolbar" }, filter, h("label", {}, hidden, "Hidden")), table.element);
  return context.connection.open("overview", {}, ({ document }) => {
    actions = actionsAmong(Object.values(document.services ?? {}));
    draw();
  });
}
