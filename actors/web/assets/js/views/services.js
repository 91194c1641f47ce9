// @ts-check
// All services: their types, servers, clients and calls that wait.

import { h } from "../dom.js";
import { addressOf } from "../routes.js";
import { isHidden, isStandard } from "../names.js";
import { Table } from "../table.js";

/** @typedef {import("../main.js").Context} Context */
/** @typedef {import("../names.js").Row} Row */

/**
 * @param {HTMLElement} container
 * @param {Context} context
 * @returns {() => void}
 */
export function show(container, context) {
  const table = new Table("Services", /** @type {import("../table.js").Column<Row>[]} */ ([
    { title: "Service", value: (row) => row.name, href: (row) => addressOf("service", row.name) },
    { title: "Type", value: (row) => row.types.join(", "), style: (row) => (row.types.length > 1 ? "bad" : "") },
    { title: "Servers", value: (row) => row.servers, style: (row) => (row.servers ? "" : "warn"), number: true },
    { title: "Clients", value: (row) => row.clients, number: true },
    { title: "Pending calls", value: (row) => row.owed_calls, number: true },
  ]));
  const filter = h("input", { type: "search", placeholder: "Part of a name or type", "aria-label": "Filter", oninput: () => draw() });
  const standard = h("input", { type: "checkbox", onchange: () => draw() });
  const hidden = h("input", { type: "checkbox", onchange: () => draw() });
  /** @type {Record<string, Row>} */
  let services = {};
  const draw = () => {
    const shown = Object.entries(services).filter(
      ([name, row]) =>
        (hidden.checked || !isHidden(name)) &&
        (standard.checked || !isStandard(row)) &&
        [name, ...row.types].some((text) => text.includes(filter.value)),
    );
    table.show(Object.fromEntries(shown));
  };
  const boxes = [h("label", {}, standard, "Standard"), h("label", {}, hidden, "Hidden")];
  container.append(h("h2", {}, "Services"), h("div", { class: "toolbar" }, filter, ...boxes), table.element);
  return context.connection.open("overview", {}, ({ document }) => {
    services = document.services ?? {};
    draw();
  });
}
