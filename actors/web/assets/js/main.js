// @ts-check
// The page: its views, which one is shown, and the state of the connection.

import { hasToken, request, signIn, signOut, takeToken } from "./api.js";
import { Connection } from "./connection.js";
import { h, setText } from "./dom.js";
import { addressOf, readAddress } from "./routes.js";
import { askForToken } from "./sign_in.js";

/**
 * What views get.
 * @typedef {object} Context
 * @property {Connection} connection
 * @property {string} name the rest of the address: what of the view is shown, such as a topic; may be empty
 * @property {boolean} control whether anything may be controlled
 * @property {string} refusal why not; empty if so
 */
/**
 * A view's module.
 * @typedef {object} View
 * @property {(place: HTMLElement, context: Context) => (() => void)} show fills the place; returns what clears up
 */

/** @type {Record<string, [title: string, load: () => Promise<View>, inMenu: boolean]>} */
const VIEWS = {
  graph: ["Graph", () => import("./views/graph.js"), true],
  topics: ["Topics", () => import("./views/topics.js"), true],
  topic: ["Topic", () => import("./views/topic.js"), false],
  plot: ["Plot", () => import("./views/plot.js"), true],
  nodes: ["Nodes", () => import("./views/nodes.js"), true],
  node: ["Node", () => import("./views/node.js"), false],
  services: ["Services", () => import("./views/services.js"), true],
  service: ["Service", () => import("./views/service.js"), false],
  actions: ["Actions", () => import("./views/actions.js"), true],
  action: ["Action", () => import("./views/action.js"), false],
  log: ["Log", () => import("./views/log.js"), true],
};
const FIRST = "graph";

takeToken();
if (hasToken()) {
  await signIn().catch(() => {}); // /api/session says whether a token is needed
}
const connection = new Connection(`${location.origin.replace(/^http/, "ws")}/api/live`);
const content = /** @type {HTMLElement} */ (document.getElementById("content"));
const views = /** @type {HTMLElement} */ (document.getElementById("views"));
let clear = () => {};
let shown = 0;
/** What the server says of who uses this page. */
let session = {
  control: false,
  refusal: "Not known yet whether control is allowed",
  token_needed: false,
  user: /** @type {string | null} */ (null),
};

for (const [id, [title, , inMenu]] of Object.entries(VIEWS)) {
  if (inMenu) {
    views.append(h("a", { href: addressOf(id), "data-view": id }, title));
  }
}

/** Show the view that the address names. */
async function show() {
  const { view, name } = readAddress(location.hash);
  const id = Object.hasOwn(VIEWS, view) ? view : FIRST;
  const [title, load] = VIEWS[id];
  const mine = ++shown;
  const [module, problem] = await load().then((found) => /** @type {const} */ ([found, ""]), (error) => /** @type {const} */ ([null, String(error.message)]));
  if (mine !== shown) {
    return; // another one has been chosen meanwhile
  }
  clear();
  for (const link of views.querySelectorAll("a")) {
    link.removeAttribute("aria-current");
    if (link.dataset.view === id || link.dataset.view === `${id}s`) {
      link.setAttribute("aria-current", "page");
      link.scrollIntoView({ block: "nearest", inline: "nearest" });
    }
  }
  document.title = `${name || title} - callboard`;
  content.replaceChildren();
  if (module === null) {
    clear = () => {};
    content.append(h("p", { class: "notice bad", role: "alert" }, `This view cannot be loaded: ${problem}`));
    return;
  }
  clear = module.show(content, { connection, name, control: session.control, refusal: session.refusal ?? "" });
}

/** Ask what this page may do, and show the view anew if that has changed: the server may be another one now. */
async function readSession() {
  let found = session;
  try {
    found = await request("GET", "/api/session");
  } catch (error) {
    const { status, message } = /** @type {import("./api.js").ApiError} */ (error);
    if (status === 401) {
      shown += 1; // no view that is being loaded replaces the question
      clear();
      clear = askForToken(content, () => readSession().then(show));
      return;
    }
    found = { ...session, control: false, refusal: message };
  }
  const before = session; // which another answer may have changed meanwhile
  session = found;
  showStatus();
  signOutButton.hidden = !session.token_needed;
  if (session.control !== before.control || session.refusal !== before.refusal) {
    await show();
  }
}

/** The broker that the server has lost; empty while it is connected. */
let lostBroker = "";

/** Say whether what is shown is up to date. */
function showStatus() {
  const status = /** @type {HTMLElement} */ (document.getElementById("status"));
  const problem = connection.connected ? lostBroker && `no broker at ${lostBroker}` : "not connected";
  status.classList.toggle("lost", Boolean(problem));
  const as = session.user === null ? "" : ` as ${session.user}`;
  setText(status, problem ? `${problem}: what you see is old` : `live${as}`);
}

const signOutButton = /** @type {HTMLElement} */ (document.getElementById("sign-out"));
signOutButton.addEventListener("click", () => signOut().finally(() => location.reload()));

const theme = /** @type {HTMLElement} */ (document.getElementById("theme"));
const THEMES = ["system", "light", "dark"];

/** @param {string} name */
function setTheme(name) {
  document.documentElement.dataset.theme = name;
  localStorage.setItem("callboard-theme", name);
  setText(theme, `Theme: ${name}`);
}

theme.addEventListener("click", () => {
  const now = THEMES.indexOf(document.documentElement.dataset.theme ?? "");
  setTheme(THEMES[(now + 1) % THEMES.length]);
});
setTheme(localStorage.getItem("callboard-theme") ?? THEMES[0]);
connection.addEventListener("change", showStatus);
connection.open("broker", {}, ({ document: { connected, target } }) => {
  lostBroker = connected === false ? target : "";
  showStatus();
});
connection.addEventListener("change", () => connection.connected && readSession());
window.addEventListener("hashchange", async () => {
  if (takeToken()) {
    await signIn().catch(() => {});
    await readSession();
  }
  await show();
});
readSession();
