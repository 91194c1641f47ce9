// @ts-check
// A form that publishes one message on a topic.

import { pathOf, request } from "./api.js";
import { h } from "./dom.js";
import { FormPanel } from "./form_panel.js";
import { typeQuery } from "./type_choice.js";

/** @typedef {import("./main.js").Context} Context */

/**
 * Return a folded form, which is loaded when it is opened first, and a function that loads it for another type.
 *
 * @param {Context} context its name is the topic
 * @param {() => string} type returns the type of the message; empty for the topic's only one
 */
export function publishForm(context, type) {
  const topic = context.name;
  const panel = new FormPanel(context, {
    path: () => pathOf("topics", topic, `/form${typeQuery(type())}`),
    title: "One message",
    verb: "Publish",
    send: async (message) => {
      try {
        const { subscriptions } = await request("POST", pathOf("topics", topic), { message, type: type() });
        panel.say(`Published on ${topic}, to ${subscriptions === 1 ? "1 subscription" : `${subscriptions} subscriptions`}`, "good");
      } catch (error) {
        panel.say(`Not published: ${/** @type {Error} */ (error).message}`, "bad");
      }
    },
  });
  const details = h("details", {}, h("summary", {}, "Publish a message"), panel.element);
  details.addEventListener("toggle", () => panel.load(), { once: true });
  const reload = () => details.open && panel.load();
  return { element: details, reload };
}
