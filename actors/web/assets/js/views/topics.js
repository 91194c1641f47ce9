// @ts-check
// All topics with their rates.

import { h, setText } from "../dom.js";
import { bytes, duration, short } from "../format.js";
import { isHidden } from "../names.js";
import { addressOf } from "../routes.js";
import { Table } from "../table.js";

/** @typedef {import("../main.js").Context} Context */

/** Topics whose delays are measured at the same time. */
const MAX_MEASURED = 64;

/** How long the topics that are shown must stay the same before their delays are measured, in milliseconds. */
const SETTLE_MS = 300;

const DELAY_NOTE = "The age of messages on arrival: by header.stamp where they have one, else since they were sent.";

/**
 * @param {HTMLElement} container
 * @param {Context} context
 * @returns {() => void}
 */
export function show(container, context) {
  /** @type {Record<string, number>} */
  let delays = {};
  const table = new Table("Topics", [
    { title: "Topic", value: (row) => row.name, href: (row) => addressOf("topic", row.name) },
    { title: "Type", value: (row) => row.types.join(", "), style: (row) => (row.types.length > 1 ? "bad" : "") },
    { title: "Publishers", value: (row) => row.publishers, number: true },
    { title: "Subscriptions", value: (row) => row.subscriptions, number: true },
    { title: "Messages/s", value: (row) => row.messages_per_sec, text: (row) => short(row.messages_per_sec), number: true },
    { title: "Bytes/s", value: (row) => row.bytes_per_sec, text: (row) => bytes(row.bytes_per_sec), number: true },
    { title: "Delay", value: (row) => delays[row.name], text: (row) => duration(delays[row.name]), number: true },
    { title: "Queued", value: (row) => row.queued, text: (row) => short(row.queued), number: true },
    {
      title: "Dropped", value: (row) => lost(row), text: (row) => short(lost(row)),
      style: (row) => (row.drops_per_sec ? "bad" : ""), number: true,
    },
  ]);
  const filter = h("input", { type: "search", placeholder: "Part of a name or type", "aria-label": "Filter", oninput: () => draw() });
  const hidden = h("input", { type: "checkbox", onchange: () => draw() });
  /** @type {Record<string, any>} */
  let topics = {};
  const measureDelays = h("input", { type: "checkbox", onchange: () => draw() });
  const note = h("p", { class: "dim" });
  const measurement = new DelayMeasurement(context, (found, text) => {
    delays = found;
    setText(note, text);
    draw();
  });
  const draw = () => {
    const shown = Object.entries(topics).filter(
      ([name, row]) =>
        (hidden.checked || !isHidden(name)) && [name, ...row.types].some((text) => text.includes(filter.value)),
    );
    table.show(Object.fromEntries(shown));
    measurement.measure(measureDelays.checked ? shown.map(([name]) => name) : []);
  };
  container.append(
    h("h2", {}, "Topics"),
    h("div", { class: "toolbar" }, filter, h("label", {}, hidden, "Hidden"), h("label", {}, measureDelays, "Measure delays")),
    note,
    table.element,
  );
  const close = context.connection.open("overview", {}, ({ document }) => {
    topics = document.topics ?? {};
    draw();
  });
  return () => {
    close();
    measurement.close();
  };
}

/**
 * @param {any} row of a topic
 * @returns {number | null} copies that did not arrive; null if the broker does not say
 */
function lost({ dropped, lost_on_break }) {
  return dropped === null ? null : dropped + lost_on_break;
}

/** Measures the delays of topics. The server subscribes to each of them, so it is done on demand only. */
class DelayMeasurement {
  /**
   * @param {Context} context
   * @param {(delays: Record<string, number>, text: string) => void} onDelays called with seconds by topic
   */
  constructor({ connection }, onDelays) {
    this._connection = connection;
    this._onDelays = onDelays;
    this._topics = "";
    this._timer = 0;
    this._close = () => {};
  }

  /** @param {string[]} topics full names; the first ones are measured */
  measure(topics) {
    const chosen = topics.slice(0, MAX_MEASURED);
    if (chosen.join() !== this._topics) {
      this._topics = chosen.join();
      clearTimeout(this._timer);
      this._timer = window.setTimeout(() => this._open(chosen, topics.length), SETTLE_MS);
    }
  }

  /** Measure no more. */
  close() {
    clearTimeout(this._timer);
    this._close();
  }

  /**
   * @param {string[]} topics
   * @param {number} shown
   */
  _open(topics, shown) {
    this._close();
    this._close = () => {};
    if (!topics.length) {
      this._onDelays({}, "");
      return;
    }
    const text = shown > topics.length ? `${DELAY_NOTE} Only the first ${topics.length} topics are read: filter them.` : DELAY_NOTE;
    this._close = this._connection.open("delays", { topics }, ({ document, body }) => {
      this._onDelays(document.delays ?? {}, body.error ?? text);
    });
  }
}
