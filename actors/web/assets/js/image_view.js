// @ts-check
// The images of a topic. The next one is asked for when one is drawn, so a slow browser gets fewer of them.

import { fetchFrom, pathOf } from "./api.js";
import { h, setText } from "./dom.js";
import { bytes, clock, short } from "./format.js";

const TYPES = ["sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/Image"];

/** Least time between two requests, in milliseconds; the server has no more images either. */
const PERIOD_MS = 100;

/** Before the next request after an error, in milliseconds. */
const RETRY_MS = 1000;

/** Images over which the rate is measured. */
const MEASURED = 20;

/** @param {string[]} types of a topic */
export function hasImages(types) {
  return types.some((type) => TYPES.includes(type));
}

/** Shows the newest image of a topic; nothing while the page is hidden. */
export class ImageView {
  /** @param {string} topic */
  constructor(topic) {
    this._topic = topic;
    this._paused = false;
    this._number = "0";
    /** @type {number[]} */
    this._times = [];
    this._closed = new AbortController();
    this._request = new AbortController();
    this._resume = () => {};
    this._canvas = h("canvas", { role: "img", "aria-label": `Image of ${topic}`, hidden: true });
    this._line = h("p", { class: "dim" }, "No image yet.");
    this.element = h("div", { class: "image" }, this._canvas, this._line);
    document.addEventListener("visibilitychange", () => this._followState(), { signal: this._closed.signal });
    this._run();
  }

  /** @param {boolean} paused whether the image stays as it is */
  setPaused(paused) {
    this._paused = paused;
    this._followState();
  }

  /** Ask for no more images. */
  close() {
    this._closed.abort();
    this._followState();
  }

  get _idle() {
    return document.hidden || this._paused;
  }

  /** Abort the request or resume, as the page is visible or paused. */
  _followState() {
    if (this._idle || this._closed.signal.aborted) {
      this._request.abort();
    }
    this._resume();
  }

  async _run() {
    while (!this._closed.signal.aborted) {
      if (this._idle) {
        this._times = [];
        await new Promise((resolve) => (this._resume = () => resolve(null)));
        continue;
      }
      const since = performance.now();
      let pause = PERIOD_MS;
      try {
        await this._next();
      } catch (error) {
        if (!this._request.signal.aborted) {
          setText(this._line, /** @type {Error} */ (error).message);
          this._canvas.hidden = true;
          pause = RETRY_MS;
        }
      }
      await new Promise((resolve) => setTimeout(resolve, since + pause - performance.now()));
    }
  }

  async _next() {
    this._request = new AbortController();
    const path = pathOf("topics", this._topic, `/image?after=${this._number}`);
    const response = await fetchFrom("GET", path, undefined, this._request.signal);
    if (response.status === 204) {
      return;
    }
    const file = await response.blob();
    const bitmap = await createImageBitmap(file).catch(() => {
      throw new Error(`The browser cannot draw this ${file.type} file`);
    });
    this._number = response.headers.get("Image-Number") ?? "0";
    if (!this._request.signal.aborted) {
      this._draw(bitmap, response.headers, file.size);
    }
    bitmap.close();
  }

  /**
   * @param {ImageBitmap} bitmap
   * @param {Headers} headers
   * @param {number} size of the file
   */
  _draw(bitmap, headers, size) {
    const { width, height } = bitmap;
    this._canvas.width = width;
    this._canvas.height = height;
    this._canvas.getContext("2d")?.drawImage(bitmap, 0, 0);
    this._canvas.hidden = false;
    const encoding = headers.get("Image-Encoding");
    this._canvas.setAttribute("aria-label", `Image of ${this._topic}, ${width} × ${height}, ${encoding}`);
    const parts = [clock(Number(headers.get("Image-Sent-Ns"))), `${width} × ${height}`, encoding, bytes(size)];
    setText(this._line, [...parts, `${short(this._rate())} images/s shown`].join(" · "));
  }

  /** Count an image; return how many are shown a second. */
  _rate() {
    this._times = [...this._times, performance.now()].slice(-MEASURED);
    const [first] = this._times;
    const passed = this._times[this._times.length - 1] - first;
    return passed ? ((this._times.length - 1) * 1000) / passed : null;
  }
}
