// @ts-check
// One action: who serves and uses it, a form that sends goals, and the goals with their feedback.

import { pathOf, request, stream } from "../api.js";
import { announce, h, setText } from "../dom.js";
import { parseExact } from "../exact_json.js";
import { FormPanel } from "../form_panel.js";
import { MessageTree } from "../message_tree.js";
import { addressOf } from "../routes.js";
import { Table } from "../table.js";
import { TypeChoice, typeQuery } from "../type_choice.js";

/** @typedef {import("../main.js").Context} Context */

/** Goals that are shown; the oldest that have ended make room. */
const MAX_SHOWN = 20;

/** Between two looks at goals that are not followed here, in milliseconds. */
const ASK_MS = 1000;

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
    { title: "Type", value: (row) => row.types.join(", ") },
  ]);
  const cancelOnClose = h("input", { type: "checkbox", disabled: !context.control });
  const goals = h("div");
  /** @type {Set<GoalCard>} */
  const cards = new Set();
  let types = "";
  const choice = new TypeChoice(() => form.load());
  const form = new FormPanel(context, {
    path: () => pathOf("actions", name, `/form${typeQuery(choice.value)}`),
    title: "Send a goal",
    verb: "Send the goal",
    send: (goal) => {
      const card = new GoalCard(context);
      cards.add(card);
      goals.prepend(card.element);
      makeRoom(cards);
      card.send({ goal, type: choice.value, cancel_on_close: cancelOnClose.checked }, form);
    },
    extras: [h("label", {}, cancelOnClose, "Cancel it when this view is left; otherwise it goes on")],
  });
  container.append(
    h("h2", {}, name),
    summary,
    choice.element,
    h("details", { open: true }, h("summary", {}, "Servers and clients"), ends.element),
    form.element,
    h("h3", {}, "Goals"),
    goals,
  );
  const close = connection.open("action", { name }, ({ document }) => {
    setText(summary, document.name ? document.types.join(", ") : "There is no such action now.");
    const sides = /** @type {const} */ ([["servers", "server"], ["clients", "client"]]);
    const rows = sides.flatMap(([key, side]) => (document[key] ?? []).map((/** @type {any} */ end) => [`${side} ${end.node}`, { ...end, side }]));
    ends.show(Object.fromEntries(rows));
    choice.show(document.types ?? []);
    const now = rows.map(([key, end]) => `${key} ${end.types}`).join();
    if (document.name && now !== types) {
      types = now;
      form.load();
    }
  });
  const earlier = new EarlierGoals(context, goals);
  return () => {
    earlier.close();
    cards.forEach((card) => card.leave());
    close();
  };
}

/** @param {Set<GoalCard>} cards */
function makeRoom(cards) {
  for (const card of cards) {
    if (cards.size > MAX_SHOWN && card.ended) {
      cards.delete(card);
      card.element.remove();
    }
  }
}

/** One goal. */
class GoalCard {
  /**
   * @param {Context} context
   * @param {string} [id] of a goal that was sent earlier
   */
  constructor({ name, control }, id = "") {
    this._action = name;
    this._control = control;
    this._id = "";
    this._received = 0;
    this._following = new AbortController();
    this.ended = false;
    this._title = h("h4", {}, "A goal");
    this._status = h("p", {}, "Sending …");
    this._feedback = new MessageTree();
    this._result = new MessageTree();
    this._feedbackPart = h("section", { hidden: true }, h("h5", {}, "Feedback"), this._feedback.element);
    this._resultPart = h("section", { hidden: true }, h("h5", {}, "Result"), this._result.element);
    this._cancel = h("button", { type: "button", disabled: true, onclick: () => this._requestCancel() }, "Cancel the goal");
    this.element = h("article", { class: "card" }, this._title, this._status, this._cancel, this._feedbackPart, this._resultPart);
    if (id) {
      this._setId(id);
    }
  }

  /**
   * @param {Record<string, any>} body
   * @param {FormPanel} form
   */
  async send(body, form) {
    form.say(`Sending a goal to ${this._action} …`);
    try {
      await stream("POST", pathOf("actions", this._action), body, (kind, data) => this._take(kind, data, form), this._following.signal, parseExact);
      if (!this.ended) {
        this._end("Not followed any longer: the stream has ended", "bad");
      }
    } catch (error) {
      if (!this._following.signal.aborted) {
        const text = this._id ? `Not followed any longer: ${/** @type {Error} */ (error).message}` : `Not sent: ${/** @type {Error} */ (error).message}`;
        this._end(text, "bad");
        form.say(text, "bad");
      }
    }
  }

  /**
   * Show a goal that is not followed here.
   *
   * @param {string | undefined} status undefined if it has ended
   */
  showEarlier(status) {
    if (status === undefined) {
      this._end("Has ended; its result is not known here", "");
    } else {
      setText(this._status, `${status}; sent earlier, its feedback is not shown here`);
    }
  }

  /** Follow it no longer. */
  leave() {
    this._following.abort();
  }

  /** @param {string} id */
  _setId(id) {
    this._id = id;
    setText(this._title, `Goal ${id.slice(0, 8)}`);
    this._cancel.disabled = !this._control;
  }

  /**
   * @param {string} kind
   * @param {any} data
   * @param {FormPanel} form
   */
  _take(kind, data, form) {
    if (kind === "accepted") {
      this._setId(data.goal_id);
      setText(this._status, "Accepted");
      form.say(`${this._action} has accepted goal ${data.goal_id.slice(0, 8)}`, "good");
    } else if (kind === "feedback") {
      this._received += 1;
      this._feedbackPart.hidden = false;
      this._feedback.show(data.feedback);
      this._showProgress();
    } else if (kind === "skipped") {
      this._received += data.skipped;
      this._showProgress();
    } else if (kind === "result") {
      this._result.show(data.result);
      this._resultPart.hidden = false;
      this._end(`${data.status}, ${this._count()}`, data.status === "SUCCEEDED" ? "good" : "warn");
    } else if (kind === "error") {
      this._end(data.error, "bad");
    }
  }

  _count() {
    return this._received === 1 ? "1 feedback message" : `${this._received} feedback messages`;
  }

  _showProgress() {
    setText(this._status, `Executing, ${this._count()}`);
  }

  /**
   * @param {string} text
   * @param {string} style
   */
  _end(text, style) {
    this.ended = true;
    this._cancel.disabled = true;
    this._status.className = style;
    setText(this._status, text);
    announce(`Goal ${this._id.slice(0, 8)}: ${text}`);
  }

  async _requestCancel() {
    this._cancel.disabled = true;
    try {
      await request("DELETE", pathOf("actions", this._action, `/goals/${this._id}`));
      announce(`Goal ${this._id.slice(0, 8)} is being cancelled`);
      if (!this.ended) {
        setText(this._status, "Cancelling");
      }
    } catch (error) {
      const text = `Not cancelled: ${/** @type {Error} */ (error).message}`;
      announce(text);
      if (!this.ended) {
        setText(this._status, text);
        this._cancel.disabled = false;
      }
    }
  }
}

/** The goals that have not ended and that nobody here follows: of an earlier view, or of another page. */
class EarlierGoals {
  /**
   * @param {Context} context
   * @param {HTMLElement} container
   */
  constructor(context, container) {
    this._context = context;
    this._container = container;
    this._leaving = new AbortController();
    this._timer = 0;
    /** @type {Map<string, GoalCard> | null} */
    this._cards = null;
    this._ask();
  }

  /** Ask no longer. */
  close() {
    this._leaving.abort();
    clearTimeout(this._timer);
  }

  async _ask() {
    const path = pathOf("actions", this._context.name, "/goals");
    /** @type {{goal_id: string, status: string}[] | null} */
    const found = await request("GET", path, undefined, this._leaving.signal).catch(() => null);
    if (found !== null) {
      this._show(new Map(found.map(({ goal_id, status }) => [goal_id, status])));
    }
    if (!this._leaving.signal.aborted && (this._cards === null || this._cards.size)) {
      this._timer = window.setTimeout(() => this._ask(), ASK_MS);
    }
  }

  /** @param {Map<string, string>} goals status by id; what was not there at first has a card that follows it */
  _show(goals) {
    this._cards ??= new Map([...goals.keys()].map((id) => [id, this._card(id)]));
    for (const [id, card] of this._cards) {
      const status = goals.get(id);
      card.showEarlier(status);
      if (status === undefined) {
        this._cards.delete(id);
      }
    }
  }

  /** @param {string} id */
  _card(id) {
    const card = new GoalCard(this._context, id);
    this._container.append(card.element);
    return card;
  }
}
