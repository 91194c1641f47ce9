// @ts-check
// One topic: its rates, who publishes and subscribes, and its messages as they come.

import { announce, h, setText } from "../dom.js";
import { bytes, clock, duration, qosText, short } from "../format.js";
import { ImageView, hasImages } from "../image_view.js";
import { MessageTree } from "../message_tree.js";
import { isPlotted, togglePlotted } from "../plotted_fields.js";
import { publishForm } from "../publish_form.js";
import { addressOf } from "../routes.js";
import { Table } from "../table.js";
import { TypeChoice } from "../type_choice.js";

/** @typedef {import("../main.js").Context} Context */

/** Least time between two messages that are shown, in milliseconds: faster ones cannot be read. */
const SHOW_MS = 100;

/**
 * @param {HTMLElement} container
 * @param {Context} context
 * @returns {() => void}
 */
export function show(container, context) {
  const { connection, name } = context;
  const summary = h("p");
  const ends = new Table("Publishers and subscriptions", [
    { title: "Node", value: (row) => row.node, href: (row) => addressOf("node", row.node) },
    { title: "Side", value: (row) => row.side },
    { title: "Type", value: (row) => row.type },
    { title: "QoS", value: (row) => qosText(row.qos) },
  ]);
  const head = h("p", { class: "dim" }, "No message yet.");
  const tree = new MessageTree((path) => plotButton(name, path));
  const pictures = h("div");
  /** @type {ImageView | null} */
  let images = null;
  let paused = false;
  let received = 0;
  let skipped = 0;
  /** @type {Record<string, any> | null} */
  let newest = null;
  const pause = h(
    "button",
    {
      type: "button",
      "aria-pressed": "false",
      onclick: () => {
        paused = !paused;
        pause.setAttribute("aria-pressed", String(paused));
        images?.setPaused(paused);
        announce(paused ? "paused" : "goes on");
      },
    },
    "Pause",
  );
  const choice = new TypeChoice(() => {
    closeEcho();
    closeEcho = openEcho();
    publishing.reload();
  });
  const publishing = publishForm(context, () => choice.value);
  const plot = h("a", { href: addressOf("plot") }, "Open the plot");
  container.append(
    h("h2", {}, name),
    summary,
    h("details", { open: true }, h("summary", {}, "Publishers and subscriptions"), ends.element),
    h("h3", {}, "Messages"),
    h("div", { class: "toolbar" }, pause, plot, choice.element),
    pictures,
    head,
    tree.element,
    publishing.element,
  );
  const draw = () => {
    if (newest === null || paused) {
      return;
    }
    const { node, sent_ns, delay_sec, header_delay_sec, message, error } = newest;
    const age = header_delay_sec === undefined ? "" : ` (header.stamp: ${duration(header_delay_sec)})`;
    setText(head, `${clock(sent_ns)} from ${node}, after ${duration(delay_sec)}${age}, ${bytes(newest.bytes)}; ${received} received, ${skipped} not shown`);
    if (error) {
      tree.show(error);
    } else {
      tree.show(message);
    }
    newest = null;
  };
  const timer = setInterval(draw, SHOW_MS);
  const closeTopic = connection.open("topic", { topic: name }, ({ document }) => {
    setText(summary, document.name ? summaryOf(document) : "There is no such topic now.");
    const sides = /** @type {const} */ ([["publishers", "publisher"], ["subscriptions", "subscription"]]);
    const rows = sides.flatMap(([key, side]) => (document[key] ?? []).map((/** @type {any} */ end) => [`${end.endpoint_id}`, { ...end, side }]));
    ends.show(Object.fromEntries(rows));
    choice.show(document.types ?? []);
    if (images === null && hasImages(document.types ?? [])) {
      images = new ImageView(name);
      images.setPaused(paused);
      pictures.append(images.element);
    }
  });
  const openEcho = () =>
    connection.open("echo", { topic: name, type: choice.value }, ({ body }) => {
      if (body.error) {
        setText(head, body.error);
        return;
      }
      received += body.messages.length + body.skipped;
      skipped += body.messages.length + body.skipped - 1;
      newest = body.messages[body.messages.length - 1];
    });
  let closeEcho = openEcho();
  return () => {
    clearInterval(timer);
    closeTopic();
    closeEcho();
    images?.close();
  };
}

/** @param {Record<string, any>} topic */
function summaryOf({ types, rates }) {
  const parts = [types.join(", ") || "any type"];
  if (rates) {
    parts.push(`${short(rates.messages_per_sec)} messages/s`, `${bytes(rates.bytes_per_sec)}/s`, `${short(rates.queued)} queued`);
    parts.push(`${short(rates.dropped)} dropped`);
    if (rates.shared_per_sec) {
      parts.push(`${short(rates.shared_per_sec)} messages/s in shared memory`);
    }
  }
  return parts.join(" · ");
}

/**
 * @param {string} topic
 * @param {string} path
 */
function plotButton(topic, path) {
  const button = h(
    "button",
    {
      type: "button",
      class: "plot-button",
      "aria-label": `Plot ${path}`,
      "aria-pressed": String(isPlotted(topic, path)),
      onclick: () => {
        togglePlotted(topic, path);
        button.setAttribute("aria-pressed", String(isPlotted(topic, path)));
        announce(isPlotted(topic, path) ? `${path} is plotted` : `${path} is not plotted any more`);
      },
    },
    "plot",
  );
  return button;
}
