// @ts-check
// All topics with their rates.

import { h } from "../dom.js";
import { bytes, short } from "../format.js";
import { addressOf } from "../routes.js";
import { Table } from "../table.js";

/** @typedef {import("../main.js").Context} Context */

/**
 * @param {HTMLElement} place
 * @param {Context} context
 * @returns {() => void}
 */
export function show(place, context) {
  const table = new Table("Topics", [
    { title: "Topic", value: (row) => row.name, href: (row) => addressOf("topic", row.name) },
    { title: "Type", value: (row) => row.types.join(", "), style: (row) => (row.types.length > 1 ? "bad" : "") },
    { title: "Publishers", value: (row) => row.publishers, number: true },
    { title: "Subscriptions", value: (row) => row.subscriptions, number: true },
    { title: "Messages/s", value: (row) => row.messages_per_sec, text: (row) => short(row.messages_per_sec), number: true },
    { title: "Bytes/s", value: (row) => row.bytes_per_sec, text: (row) => bytes(row.bytes_per_sec), number: true },
    { title: "Queued", value: (row) => row.queued, text: (row) => short(row.queued), number: true },
    {
      title: "Dropped", value: (row) => row.dropped + row.lost_on_break, text: (row) => short(row.dropped + row.lost_on_break),
      style: (row) => (row.drops_per_sec ? "bad" : ""), number: true,
    },
  ]);
  const filter = h("input", { type: "search", placeholder: "Part of a name or type", "aria-label": "Filter", oninput: () => draw() });
  const hidden = h("input", { type: "checkbox", onchange: () => draw() });
  /** @type {Record<string, any>} */
  let topics = {};
  const draw = () => {
    const shown = Object.entries(topics).filter(
      ([name, row]) =>
        (hidden.checked || !/(^|\/)_/.test(name)) && [name, ...row.types].some((text) => text.includes(filter.value)),
    );
    table.show(Object.fromEntries(shown));
  };
  place.append(h("h2", {}, "Topics"), h("div", { class: "toolbar" }, filter, h("label", {}, hidden, "Hidden")), table.element);
  return context.connection.open("overview", {}, ({ document }) => {
    topics = document.topics ?? {};
    draw();
  });
}
