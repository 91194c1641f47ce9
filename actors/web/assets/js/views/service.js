// @ts-check
// One service: who serves and calls it, and a form that calls it.

import { pathOf, request } from "../api.js";
import { h, setText } from "../dom.js";
import { parseExact } from "../exact_json.js";
import { FormPanel } from "../form_panel.js";
import { duration } from "../format.js";
import { MessageTree } from "../message_tree.js";
import { addressOf } from "../routes.js";
import { Table } from "../table.js";
import { TypeChoice, typeQuery } from "../type_choice.js";

/** @typedef {import("../main.js").Context} Context */

const TIMEOUT_SEC = 60;

/**
 * @param {HTMLElement} container
 * @param {Context} context
 * @returns {() => void}
 */
export function show(container, context) {
  const { connection, name } = context;
  const summary = h("p");
  const ends = new Table("Servers and clients", [
    { title: "Node", value: (row) => row.node, href: (row) => addressOf("node", row.node) },
    { title: "Side", value: (row) => row.side },
    { title: "Type", value: (row) => row.type },
  ]);
  const timeout = h("input", { type: "number", min: "0.1", max: "3600", step: "any", value: String(TIMEOUT_SEC), disabled: !context.control });
  const stop = h("button", { type: "button", disabled: true, onclick: () => calling?.abort() }, "Cancel the call");
  const tree = new MessageTree();
  const response = h("section", { hidden: true }, h("h3", {}, "Response"), tree.element);
  /** @type {AbortController | null} */
  let calling = null;
  let types = "";
  const choice = new TypeChoice(() => form.load());
  const form = new FormPanel(context, {
    path: () => pathOf("services", name, `/form${typeQuery(choice.value)}`),
    title: "Call",
    verb: "Call",
    send: (value) => call(value),
    extras: [stop, h("label", {}, "Timeout in seconds ", timeout)],
  });
  /** @param {any} value */
  const call = async (value) => {
    if (calling !== null) {
      form.say("A call waits already; cancel it first", "bad");
      return;
    }
    const mine = new AbortController();
    calling = mine;
    stop.disabled = false;
    const since = performance.now();
    form.say(`Calling ${name} …`);
    try {
      const body = { request: value, type: choice.value, timeout_sec: timeout.valueAsNumber || TIMEOUT_SEC };
      const answer = await request("POST", pathOf("services", name), body, mine.signal, parseExact);
      tree.show(answer.response);
      response.hidden = false;
      form.say(`${name} has answered after ${duration((performance.now() - since) / 1000)}`, "good");
    } catch (error) {
      response.hidden = true;
      form.say(mine.signal.aborted ? "The call is cancelled" : `The call has failed: ${/** @type {Error} */ (error).message}`, "bad");
    }
    calling = null;
    stop.disabled = true;
  };
  container.append(
    h("h2", {}, name),
    summary,
    choice.element,
    h("details", { open: true }, h("summary", {}, "Servers and clients"), ends.element),
    form.element,
    response,
  );
  const close = connection.open("service", { name }, ({ document }) => {
    setText(summary, document.name ? document.types.join(", ") : "There is no such service now.");
    const sides = /** @type {const} */ ([["servers", "server"], ["clients", "client"]]);
    const rows = sides.flatMap(([key, side]) => (document[key] ?? []).map((/** @type {any} */ end) => [`${end.endpoint_id}`, { ...end, side }]));
    ends.show(Object.fromEntries(rows));
    choice.show(document.types ?? []);
    const now = rows.map(([, end]) => end.type_hash).sort().join();
    if (document.name && now !== types) {
      types = now;
      form.load();
    }
  });
  return () => {
    calling?.abort();
    close();
  };
}
