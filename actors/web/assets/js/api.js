// @ts-check
// The HTTP API, with the token of the page's address.

import { stringifyExact } from "./exact_json.js";

const KEY = "callboard-token";

/** The server's answer to a request that failed. */
export class ApiError extends Error {
  /**
   * @param {number} status
   * @param {string} text
   */
  constructor(status, text) {
    super(text);
    this.status = status;
  }
}

/**
 * Keep the token of the address (`#token=...`) for this tab, and take it out of the address.
 *
 * @returns {boolean} whether it had one
 */
export function takeToken() {
  const match = /^#token=([\w-]+)$/.exec(location.hash);
  if (match) {
    sessionStorage.setItem(KEY, match[1]);
    history.replaceState(null, "", location.pathname);
  }
  return match !== null;
}

/** Whether a token is kept for this tab. */
export function hasToken() {
  return sessionStorage.getItem(KEY) !== null;
}

/**
 * Get the cookie for reading, which the WebSocket needs where the server listens beyond loopback.
 *
 * @param {string | null} [token] to keep for this tab; by default the one that is kept
 */
export async function signIn(token = sessionStorage.getItem(KEY)) {
  await request("POST", "/api/session", { token });
  sessionStorage.setItem(KEY, /** @type {string} */ (token));
}

/** Forget the token and the cookie. */
export async function signOut() {
  sessionStorage.removeItem(KEY);
  await request("DELETE", "/api/session");
}

/**
 * Ask the API; the answer is JSON.
 *
 * @param {string} method
 * @param {string} path such as "/api/topics"
 * @param {unknown} [body] becomes JSON
 * @param {AbortSignal} [signal]
 * @param {(text: string) => any} [parse] such as `parseExact`
 * @returns {Promise<any>}
 */
export async function request(method, path, body, signal, parse = JSON.parse) {
  const response = await fetchFrom(method, path, body, signal);
  return parse(await response.text());
}

/**
 * Ask the API for a stream of server-sent events.
 *
 * @param {string} method
 * @param {string} path
 * @param {unknown} body
 * @param {(event: string, data: any) => void} onEvent
 * @param {AbortSignal} [signal] ends it
 * @param {(text: string) => any} [parse] such as `parseExact`
 */
export async function stream(method, path, body, onEvent, signal, parse = JSON.parse) {
  const response = await fetchFrom(method, path, body, signal);
  const reader = /** @type {ReadableStream<BufferSource>} */ (response.body).pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const { done, value } = await reader.read();
    if (done) {
      return;
    }
    text += value;
    const events = text.split("\n\n");
    text = /** @type {string} */ (events.pop());
    for (const event of events) {
      if (event.startsWith(":")) {
        continue; // a comment, which keeps the connection
      }
      const [, kind, data] = /** @type {RegExpExecArray} */ (/^event: (.*)\ndata: ([^]*)$/.exec(event));
      onEvent(kind, parse(data));
    }
  }
}

/**
 * Return the path of something with a name.
 *
 * @param {string} area such as "topics"
 * @param {string} name a full name
 * @param {string} [rest] such as "/echo"
 */
export function pathOf(area, name, rest = "") {
  return `/api/${area}/${encodeURIComponent(name)}${rest}`;
}

/**
 * Ask the API; the answer is anything.
 *
 * @param {string} method
 * @param {string} path
 * @param {unknown} body becomes JSON
 * @param {AbortSignal} [signal]
 */
export async function fetchFrom(method, path, body, signal) {
  /** @type {Record<string, string>} */
  const headers = {};
  const token = sessionStorage.getItem(KEY);
  if (token !== null) {
    headers.Authorization = `Bearer ${token}`;
  }
  if (body !== undefined) {
    headers["Content-Type"] = "application/json";
  }
  const response = await fetch(path, {
    method,
    headers,
    signal,
    body: body === undefined ? undefined : stringifyExact(body),
  });
  if (!response.ok) {
    const answer = await response.json().catch(() => ({}));
    throw new ApiError(response.status, answer.error ?? response.statusText);
  }
  return response;
}
