// @ts-check
// The form that asks for the server's token.

import { signIn } from "./api.js";
import { h, setText } from "./dom.js";

/**
 * Ask for the token until the server takes it.
 *
 * @param {HTMLElement} container
 * @param {() => void} onSignedIn
 * @returns {() => void} takes the form away
 */
export function askForToken(container, onSignedIn) {
  const input = h("input", { type: "password", id: "token", autocomplete: "off", required: true });
  const problem = h("p", { role: "alert" });
  const form = h(
    "form",
    {},
    h("h2", {}, "A token is required"),
    h("p", {}, "It is in the address that callboard web has printed, after #token=. A user of the broker may use the broker's token instead, if the server was started with --users."),
    h("label", { for: "token" }, "Token"),
    " ",
    input,
    " ",
    h("button", { type: "submit" }, "Sign in"),
    problem,
  );
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    try {
      await signIn(input.value.trim());
    } catch (error) {
      setText(problem, /** @type {Error} */ (error).message);
      input.select();
      return;
    }
    onSignedIn();
  });
  container.replaceChildren(form);
  input.focus();
  return () => form.remove();
}
