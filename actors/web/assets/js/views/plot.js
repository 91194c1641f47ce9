// @ts-check
// Fields of topics over time, several in one plot.

import uPlot from "../../vendor/uPlot.esm.js";
import { announce, download, h, onOtherColors, setText } from "../dom.js";
import { plottedFields, togglePlotted } from "../plotted_fields.js";
import { addressOf } from "../routes.js";

/** @typedef {import("../main.js").Context} Context */
/** @typedef {import("../plotted_fields.js").PlottedField} PlottedField */

const COLORS = ["#2f7ed8", "#d9622b", "#2e9e5b", "#a34fc4", "#c7921a", "#20a5b5", "#d13b6c", "#7a7f2a"];
const WINDOWS_SEC = [10, 30, 60, 300, 900];
const MAX_POINTS = 100_000;
const HEIGHT = 360;

/**
 * @param {HTMLElement} container
 * @param {Context} context
 * @returns {() => void}
 */
export function show(container, { connection }) {
  const view = new PlotView(container, connection);
  return () => view.close();
}

class PlotView {
  /**
   * @param {HTMLElement} container
   * @param {import("../connection.js").Connection} connection
   */
  constructor(container, connection) {
    this._connection = connection;
    this._paused = false;
    this._changed = false;
    /** @type {(() => void)[]} */
    this._ends = [];
    /** @type {Map<string, {fields: string[], times: number[], values: (number | null)[][]}>} by topic */
    this._data = new Map();
    /** @type {any} */
    this._plot = null;
    this._window = h("select", { "aria-label": "Length of the window", onchange: () => (this._changed = true) });
    for (const seconds of WINDOWS_SEC) {
      this._window.append(h("option", { value: seconds, selected: seconds === 30 }, seconds < 60 ? `${seconds} s` : `${seconds / 60} min`));
    }
    this._pause = h("button", { type: "button", "aria-pressed": "false", onclick: () => this._setPaused(!this._paused) }, "Pause");
    this._status = h("p", { class: "dim" });
    this._fields = h("ul");
    this._area = h("div", { class: "plot", role: "img", "aria-label": "Plot of the fields below" });
    container.append(
      h("h2", {}, "Plot"),
      h("div", { class: "toolbar" }, this._window, this._pause, h("button", { type: "button", onclick: () => this._download() }, "CSV")),
      this._area,
      this._status,
      this._fields,
      h("p", { class: "dim" }, "Choose numbers in a ", h("a", { href: addressOf("topics") }, "topic"), " with their plot buttons. Drag to zoom, click twice to follow again."),
    );
    this._resized = new ResizeObserver(() => this._plot?.setSize({ width: this._area.clientWidth, height: HEIGHT }));
    this._resized.observe(this._area);
    this._endColors = onOtherColors(() => this._makePlot());
    this._open();
    this._timer = setInterval(() => this._draw(), 100);
  }

  close() {
    clearInterval(this._timer);
    this._resized.disconnect();
    this._endColors();
    this._ends.forEach((end) => end());
    this._plot?.destroy();
  }

  _open() {
    this._ends.forEach((end) => end());
    this._ends = [];
    this._data.clear();
    for (const { topic, field } of plottedFields()) {
      const data = this._data.get(topic) ?? { fields: [], times: [], values: [] };
      data.fields.push(field);
      data.values.push([]);
      this._data.set(topic, data);
    }
    for (const [topic, data] of this._data) {
      this._ends.push(
        this._connection.open("plot", { topic, fields: data.fields }, ({ body }) => {
          if (body.error) {
            setText(this._status, body.error);
          } else {
            this._take(data, body);
          }
        }),
      );
    }
    this._showFields();
    this._makePlot();
  }

  /**
   * @param {{times: number[], values: (number | null)[][]}} data
   * @param {Record<string, any>} body
   */
  _take(data, { points, skipped }) {
    for (const [time, ...values] of points) {
      data.times.push(time);
      values.forEach((/** @type {number | null} */ value, /** @type {number} */ number) => data.values[number].push(value));
    }
    const tooOld = data.times.length - MAX_POINTS;
    if (tooOld > 0) {
      data.times.splice(0, tooOld);
      data.values.forEach((values) => values.splice(0, tooOld));
    }
    if (skipped) {
      setText(this._status, `${skipped} points came too fast and are left out`);
    }
    this._changed = true;
  }

  /** @param {boolean} paused */
  _setPaused(paused) {
    this._paused = paused;
    this._pause.setAttribute("aria-pressed", String(paused));
    announce(paused ? "paused" : "goes on");
  }

  _makePlot() {
    this._plot?.destroy();
    const { fontFamily } = getComputedStyle(document.body);
    const probe = h("span");
    this._area.replaceChildren(probe);
    probe.style.color = "var(--dim)";
    const dim = getComputedStyle(probe).color;
    probe.style.color = "var(--line)";
    const line = getComputedStyle(probe).color;
    probe.remove();
    const axis = { stroke: dim, grid: { stroke: line, width: 1 }, ticks: { stroke: line }, font: `12px ${fontFamily}` };
    this._plot = new uPlot(
      {
        width: this._area.clientWidth || 600,
        height: HEIGHT,
        series: [{}, ...this._labels().map((label, number) => ({ label, stroke: COLORS[number % COLORS.length], width: 1.5, spanGaps: true }))],
        axes: [axis, { ...axis, size: 70 }],
        scales: { x: { time: true } },
        cursor: { drag: { x: true, y: false } },
        hooks: { setSelect: [() => this._setPaused(true)], init: [(/** @type {any} */ plot) => plot.over.addEventListener("dblclick", () => this._setPaused(false))] },
      },
      this._tables(),
      this._area,
    );
    this._changed = true;
  }

  _labels() {
    return [...this._data].flatMap(([topic, { fields }]) => fields.map((field) => `${topic} ${field}`));
  }

  /**
   * All series over one axis of time.
   *
   * @returns {any}
   */
  _tables() {
    const tables = [...this._data.values()].map(({ times, values }) => [times, ...values]);
    return tables.length > 1 ? uPlot.join(/** @type {any} */ (tables)) : (tables[0] ?? [[]]);
  }

  _draw() {
    if (!this._changed || this._paused || document.hidden) {
      return;
    }
    this._changed = false;
    const data = this._tables();
    const last = data[0][data[0].length - 1] ?? Date.now() / 1000;
    const first = last - Number(this._window.value);
    this._plot.setData(data, false);
    this._plot.setScale("x", { min: first, max: last });
    this._area.dataset.points = String(data[0].length);
  }

  _showFields() {
    const items = plottedFields().map(({ topic, field }) =>
      h(
        "li",
        {},
        h("a", { href: addressOf("topic", topic) }, topic),
        ` ${field} `,
        h("button", { type: "button", "aria-label": `Remove ${topic} ${field}`, onclick: () => this._remove(topic, field) }, "Remove"),
      ),
    );
    this._fields.replaceChildren(...items);
  }

  /**
   * @param {string} topic
   * @param {string} field
   */
  _remove(topic, field) {
    togglePlotted(topic, field);
    this._open();
  }

  _download() {
    const [times, ...values] = this._tables();
    const quoted = (/** @type {string} */ text) => `"${text.replaceAll('"', '""')}"`;
    const lines = [["time", ...this._labels()].map(quoted).join(",")];
    times.forEach((/** @type {number} */ time, /** @type {number} */ row) => {
      lines.push([time, ...values.map((/** @type {any} */ column) => column[row] ?? "")].join(","));
    });
    download("plot.csv", `${lines.join("\n")}\n`, "text/csv");
  }
}
