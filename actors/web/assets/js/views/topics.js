// @ts-check
// All topics with their rates.

import { h } from "../dom.js";
import { bytes, short } from "../format.js";
import { Table } from "../table.js";

/** @typedef {import("../main.js").Context} Context */

/**
 * @param {HTMLElement} place
 * @param {Context} context
 * @returns {() => void}
 */
export function show(place, context) {
  const table = new Table("Topics", [
    { title: "Topic", value: (row) => row.name, href: (row) => `#/topic/${encodeURIComponent(row.name)}` },
    { title: "Type", value: (row) => row.types.join(", "), style: (row) => (row.types.length > 1 ? "bad" : "") },
    { title: "Publishers", value: (row) => row.publishers, number: true },
    { title: "Subscriptions", value: (row) => row.subscriptions, number: true },
    { title: "Messages/s", value: (row) => row.messages_per_sec, text: (row) => short(row.messages_per_sec), number: true },
    { title: "Bytes/s", value: (row) => row.bytes_per_sec, text: (row) => bytes(row.bytes_per_sec), number: true },
    { title: "Dropped", value: (row) => row.dropped, text: (row) => short(row.dropped), style: (row) => (row.drops_per_sec ? "bad" : ""), number: true },
  ]);
  place.append(h("h2", {}, "Topics"), table.element);
  return context.connection.open("overview", {}, ({ document }) => table.show(document.topics ?? {}));
}
