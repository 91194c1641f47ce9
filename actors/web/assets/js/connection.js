// @ts-check
// The page's connection to the server, which carries all panels that are open.

/** @typedef {Record<string, any>} Document */
/**
 * What a panel gets.
 * @typedef {object} Update
 * @property {Document} document the panel's document, complete; empty for panels that have none
 * @property {Document} body the message as it came
 */
/**
 * @typedef {object} OpenPanel
 * @property {string} panel
 * @property {Document} parameters
 * @property {Document} document
 * @property {(update: Update) => void} onUpdate
 */

const RETRY_MS = 1000;

/**
 * Apply a JSON Merge Patch (RFC 7396) to a document in place.
 *
 * @param {Document} target
 * @param {Document} patch
 */
export function applyPatch(target, patch) {
  for (const [key, value] of Object.entries(patch)) {
    if (value === null) {
      delete target[key];
    } else if (typeof value === "object" && !Array.isArray(value)) {
      if (typeof target[key] !== "object" || target[key] === null || Array.isArray(target[key])) {
        target[key] = Object.create(null);
      }
      applyPatch(target[key], value);
    } else {
      target[key] = value;
    }
  }
}

/**
 * Keeps a WebSocket open while the page is visible; opens the panels again after an interruption. Dispatches
 * `change` when `connected` has changed.
 */
export class Connection extends EventTarget {
  /** @param {string} url of the WebSocket */
  constructor(url) {
    super();
    this.connected = false;
    this._url = url;
    /** @type {Map<number, OpenPanel>} */
    this._panels = new Map();
    this._next = 1;
    /** @type {WebSocket | null} */
    this._socket = null;
    this._retry = 0;
    document.addEventListener("visibilitychange", () => this._followVisibility());
    this._followVisibility();
  }

  /**
   * Open a panel.
   *
   * @param {string} panel its name
   * @param {Document} parameters
   * @param {(update: Update) => void} onUpdate called with each update; with `body.error` if it cannot be shown
   * @returns {() => void} closes it
   */
  open(panel, parameters, onUpdate) {
    const id = this._next++;
    const opened = { panel, parameters, document: Object.create(null), onUpdate };
    this._panels.set(id, opened);
    this._sendOpen(id, opened);
    return () => {
      if (this._panels.delete(id)) {
        this._send({ close: id });
      }
    };
  }

  /** Connect if the page is visible, disconnect if not: a hidden page costs the server nothing. */
  _followVisibility() {
    if (document.hidden) {
      this._socket?.close();
    } else if (this._socket === null) {
      this._connect();
    }
  }

  _connect() {
    clearTimeout(this._retry);
    const socket = new WebSocket(this._url);
    this._socket = socket;
    socket.onopen = () => {
      this._setConnected(true);
      for (const [id, panel] of this._panels) {
        panel.document = Object.create(null);
        this._sendOpen(id, panel);
      }
    };
    socket.onmessage = (event) => this._receive(JSON.parse(event.data));
    socket.onclose = () => {
      this._socket = null;
      this._setConnected(false);
      if (!document.hidden) {
        this._retry = window.setTimeout(() => this._followVisibility(), RETRY_MS);
      }
    };
  }

  /** @param {boolean} connected */
  _setConnected(connected) {
    if (this.connected !== connected) {
      this.connected = connected;
      this.dispatchEvent(new Event("change"));
    }
  }

  /**
   * @param {number} id
   * @param {OpenPanel} panel
   */
  _sendOpen(id, panel) {
    this._send({ ...panel.parameters, open: id, panel: panel.panel });
  }

  /** @param {Document} document */
  _send(document) {
    if (this._socket?.readyState === WebSocket.OPEN) {
      this._socket.send(JSON.stringify(document));
    }
  }

  /** @param {Document} body */
  _receive(body) {
    const panel = this._panels.get(body.id);
    if (!panel) {
      return;
    }
    if (body.patch) {
      applyPatch(panel.document, body.patch);
    }
    panel.onUpdate({ document: panel.document, body });
  }
}
