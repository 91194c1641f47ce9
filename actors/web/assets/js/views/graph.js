// @ts-check
// The graph: nodes, topics, and on demand services and actions, as they change.

import cytoscape from "../../vendor/cytoscape.esm.min.mjs";
import { announce, download, h, onOtherColors, setChildren, setText } from "../dom.js";
import { bytes, labelsText, short } from "../format.js";
import { elementsOf, placeNear } from "../graph_elements.js";
import { svgOf } from "../graph_svg.js";
import { addressOf } from "../routes.js";

/** @typedef {import("../main.js").Context} Context */
/** @typedef {import("../graph_elements.js").GraphDocument} GraphDocument */
/** @typedef {import("../graph_elements.js").Elements} Elements */

/**
 * With more elements frames would take too long: edges become straight, without labels and clicks, and the drawing
 * is moved as an image.
 */
const MANY_ELEMENTS = 400;

/** A few vertices are not drawn larger than this. */
const MAX_FIT_ZOOM = 1.3;

/** How long nobody has typed in the filter before the graph is drawn: hundreds of vertices take longer than a key may. */
const TYPING_MS = 200;

/**
 * @param {HTMLElement} container
 * @param {Context} context
 * @returns {() => void}
 */
export function show(container, context) {
  const view = new GraphView(container, context);
  return () => view.close();
}

class GraphView {
  /**
   * @param {HTMLElement} container
   * @param {Context} context
   */
  constructor(container, context) {
    this._connection = context.connection;
    /** @type {GraphDocument} */
    this._document = {};
    this._end = () => {};
    /** @type {Elements} */
    this._elements = new Map();
    /** @type {Set<string>} */
    this._folded = new Set();
    /** @type {Map<string, {x: number, y: number}>} */
    this._positions = new Map();
    this._selected = "";
    this._laidOut = false;
    this._moved = false;
    this._many = false;
    this._layout = 0;
    this._typing = 0;
    this._worker = new Worker("js/layout_worker.js", { type: "module" });
    this._worker.onmessage = ({ data }) => this._takeLayout(data);
    this._parameters = { services: false, actions: false, hidden: false, debug: false };

    this._filter = h("input", { type: "search", placeholder: "Part of a name", "aria-label": "Filter by name", oninput: () => this._drawSoon() });
    this._grouped = this._box("Namespaces", () => this._layOut());
    this._notice = h("p", { class: "notice bad", hidden: true });
    this._empty = h("p", { class: "dim", hidden: true }, "There are no nodes.");
    this._drawing = h("div", { class: "drawing", "aria-hidden": "true" });
    this._details = h("aside", { "aria-label": "Details", hidden: true });
    this._list = h("ul");
    this._listArea = h("details", { ontoggle: () => this._showList() }, h("summary", {}, "As a list"), this._list);
    const toolbar = h(
      "div",
      { class: "toolbar" },
      this._filter,
      ...this._toggles(),
      this._grouped.label,
      h("button", { type: "button", onclick: () => this._layOut() }, "Lay out"),
      h("button", { type: "button", onclick: () => this._fit() }, "Fit"),
      h("button", { type: "button", onclick: () => this._save("svg") }, "SVG"),
      h("button", { type: "button", onclick: () => this._save("png") }, "PNG"),
    );
    container.append(
      h("section", { class: "graph" }, h("h2", { class: "hidden-text" }, "Graph"), toolbar, this._notice, this._empty,
        h("div", { class: "drawing-area" }, this._drawing, this._details), this._listArea),
    );
    this._cy = cytoscape({
      container: this._drawing,
      minZoom: 0.05,
      maxZoom: 3,
      boxSelectionEnabled: false,
      textureOnViewport: false,
      hideEdgesOnViewport: false,
    });
    this._cy.on("tap", (/** @type {any} */ event) => this._tapped(event.target === this._cy ? "" : event.target.id()));
    this._cy.on("dragfree", "node", (/** @type {any} */ event) => this._positions.set(event.target.id(), { ...event.target.position() }));
    this._endColors = onOtherColors(() => this._style());
    this._resized = new ResizeObserver(() => {
      this._cy.resize();
      if (!this._moved) {
        this._fit();
      }
    });
    this._resized.observe(this._drawing);
    this._cy.on("dragpan scrollzoom pinchzoom", () => (this._moved = true));
    this._style();
    this._open();
  }

  close() {
    clearTimeout(this._typing);
    this._end();
    this._worker.terminate();
    this._endColors();
    this._resized.disconnect();
    this._cy.destroy();
  }

  /**
   * @param {string} text
   * @param {() => void} onChange
   */
  _box(text, onChange) {
    const input = h("input", { type: "checkbox", onchange: onChange });
    return { input, label: h("label", {}, input, text) };
  }

  _toggles() {
    const names = /** @type {const} */ (["services", "actions", "hidden", "debug"]);
    return names.map((name) => {
      const { input, label } = this._box(name[0].toUpperCase() + name.slice(1), () => {
        this._parameters[name] = input.checked;
        this._end();
        this._open();
      });
      return label;
    });
  }

  _open() {
    this._end = this._connection.open("graph", this._parameters, ({ document, body }) => {
      if (body.error) {
        this._say(body.error);
        return;
      }
      this._document = document;
      this._empty.hidden = Object.keys(document.vertices ?? {}).length > 0;
      this._say(this._mismatchText() || (document.omitted ? `${document.omitted} more are not drawn` : ""));
      this._draw();
    });
  }

  /** @param {string} text */
  _say(text) {
    this._notice.hidden = !text;
    setText(this._notice, text);
  }

  _mismatchText() {
    const found = Object.values(this._document.mismatches ?? {});
    if (!found.length) {
      return "";
    }
    const more = found.length > 1 ? ` And ${found.length - 1} more.` : "";
    return `${found[0].text}.${more}`;
  }

  /** Draw when nobody has typed for a moment. */
  _drawSoon() {
    clearTimeout(this._typing);
    this._typing = window.setTimeout(() => this._draw(), TYPING_MS);
  }

  /** Make the drawing show the document: only what has changed is touched. */
  _draw() {
    const elements = elementsOf(this._document, {
      filter: this._filter.value,
      grouped: this._grouped.input.checked,
      folded: this._folded,
      rate: (value) => short(value),
    });
    if (this._many !== elements.size > MANY_ELEMENTS) {
      this._many = !this._many;
      /** @type {any} */ (this._cy).renderer().textureOnViewport = this._many; // as the option, which cannot be changed
      this._style();
    }
    const vertices = [...elements].filter(([, data]) => data.source === undefined);
    const before = this._elements;
    const structureChanged = elements.size !== before.size || [...elements.keys()].some((id) => !before.has(id));
    const newcomers = vertices.map(([id]) => id).filter((id) => !before.has(id) && !this._positions.has(id));
    placeNear(newcomers, elements, this._positions);
    this._cy.batch(() => {
      for (const id of before.keys()) {
        if (!elements.has(id)) {
          this._cy.getElementById(id).remove();
        }
      }
      for (const wanted of [vertices.filter(([, data]) => data.kind === "group"), vertices, [...elements]]) {
        for (const [id, data] of wanted) {
          this._show(id, this._many && data.source !== undefined ? { ...data, label: "" } : data);
        }
      }
    });
    this._elements = elements;
    if (!this._laidOut && vertices.length) {
      this._laidOut = true;
      this._layOut();
    }
    if (structureChanged) {
      this._showList();
    }
    this._showDetails();
  }

  /**
   * @param {string} id
   * @param {Record<string, any>} data
   */
  _show(id, data) {
    const found = this._cy.getElementById(id);
    if (found.empty()) {
      const at = data.source === undefined ? this._positions.get(id) : undefined;
      const position = at && { ...at };
      this._cy.add({ group: data.source === undefined ? "nodes" : "edges", data: { id, ...data }, position });
      return;
    }
    if ((data.parent ?? null) !== (found.data("parent") ?? null)) {
      found.move({ parent: data.parent ?? null });
    }
    for (const [key, value] of Object.entries(data)) {
      if (key !== "parent" && found.data(key) !== value) {
        found.data(key, value);
      }
    }
  }

  /** Lay everything out anew. */
  _layOut() {
    this._draw();
    const boxes = [...this._elements]
      .filter(([, data]) => data.source === undefined)
      .map(([id, data]) => ({ id, parent: data.parent, block: blockOf(id), ...sizeOf(String(data.label)) }));
    const edges = [...this._elements.values()].filter((data) => data.source !== undefined).map((data) => [data.source, data.target]);
    this._layout += 1;
    this._worker.postMessage({ number: this._layout, boxes, edges });
  }

  /** @param {{number: number, positions: [string, {x: number, y: number}][]}} answer */
  _takeLayout({ number, positions }) {
    if (number !== this._layout) {
      return; // another one has been asked for meanwhile
    }
    this._positions = new Map(positions);
    this._cy.batch(() => {
      for (const [id, position] of positions) {
        const found = this._cy.getElementById(id);
        if (found.nonempty() && !found.isParent()) {
          found.position({ ...position });
        }
      }
    });
    this._fit();
    this._drawing.dataset.ready = String(number);
  }

  /** Show the whole drawing, as long as nobody moves it. */
  _fit() {
    this._moved = false;
    this._cy.fit(this._cy.elements(), 20);
    if (this._cy.zoom() > MAX_FIT_ZOOM) {
      this._cy.zoom(MAX_FIT_ZOOM);
      this._cy.center();
    }
  }

  /** @param {string} id */
  _tapped(id) {
    const data = this._elements.get(id);
    if (data?.kind === "group") {
      const namespace = id.slice("group ".length);
      if (!this._folded.delete(namespace)) {
        this._folded.add(namespace);
      }
      this._draw();
      return;
    }
    this._selected = id;
    this._cy.$(":selected").unselect();
    this._cy.getElementById(id).select();
    this._showDetails();
  }

  /** Show what is known of what is selected. */
  _showDetails() {
    const vertex = this._document.vertices?.[this._selected];
    const edge = this._document.edges?.[this._selected];
    this._details.hidden = !vertex && !edge;
    /** @type {(Node | null)[]} */
    const parts = [];
    if (vertex) {
      parts.push(
        h("h3", {}, h("a", { href: addressOf(vertex.kind, vertex.name) }, vertex.name)),
        h("p", {}, [vertex.kind, ...(vertex.types ?? []), vertex.broker && `on ${vertex.broker}`, labelsText(vertex.labels), vertex.state].filter(Boolean).join(", ")),
      );
      if (vertex.kind === "topic") {
        const rates = `${short(vertex.messages_per_sec)} messages/s, ${bytes(vertex.bytes_per_sec)}/s, ${short(vertex.dropped)} dropped`;
        parts.push(h("p", {}, rates));
      }
      parts.push(this._neighbours(this._selected));
    } else if (edge) {
      parts.push(
        h("h3", {}, edge.relation),
        h("ul", {}, ...[edge.source, edge.target].map((id) => h("li", {}, this._link(id)))),
      );
    }
    for (const { text, vertices } of Object.values(this._document.mismatches ?? {})) {
      if (vertices.includes(this._selected) || (edge && vertices.includes(edge.source) && vertices.includes(edge.target))) {
        parts.push(h("p", { class: "bad" }, text));
      }
    }
    setChildren(this._details, ...parts);
  }

  /** @param {string} id */
  _neighbours(id) {
    const items = Object.values(this._document.edges ?? {}).flatMap(({ source, target, relation }) => {
      const other = source === id ? target : target === id ? source : "";
      return other ? [h("li", {}, `${relation}: `, this._link(other))] : [];
    });
    return h("ul", {}, ...items);
  }

  /** @param {string} id */
  _link(id) {
    const name = id.slice(id.indexOf(" ") + 1);
    return h("button", { type: "button", class: "link", "data-id": id, onclick: () => this._select(id) }, name);
  }

  /** @param {string} id */
  _select(id) {
    this._tapped(id);
    const found = this._cy.getElementById(id);
    if (found.nonempty()) {
      this._cy.animate({ center: { eles: found } }, { duration: 150 });
    }
    announce(`${id} is selected`);
  }

  /** The same for those who do not see the drawing; nothing while the list is closed. */
  _showList() {
    if (!this._listArea.open) {
      return;
    }
    const items = Object.keys(this._document.vertices ?? {})
      .sort()
      .map((id) => h("li", {}, `${id.slice(0, id.indexOf(" "))} `, this._link(id)));
    this._list.replaceChildren(...items);
  }

  _style() {
    const colors = this._palette();
    /** @type {any[]} */
    const style = [
      {
        selector: "node",
        style: {
          label: "data(label)", "text-wrap": "wrap", "text-valign": "center", "font-size": 12, "min-zoomed-font-size": 4, "font-family": "system-ui, sans-serif",
          width: (/** @type {any} */ element) => sizeOf(element.data("label")).width,
          height: (/** @type {any} */ element) => sizeOf(element.data("label")).height,
          color: colors.text, "background-color": colors.raised, "border-width": 1.5, "border-color": colors.accent, shape: "round-rectangle",
        },
      },
      { selector: 'node[kind = "node"]', style: { "background-color": colors.accent, color: colors.onAccent } },
      { selector: 'node[kind = "topic"]', style: { shape: "ellipse" } },
      { selector: 'node[kind = "service"]', style: { shape: "cut-rectangle", "border-color": colors.good } },
      { selector: 'node[kind = "action"]', style: { shape: "octagon", "border-color": colors.warn } },
      { selector: 'node[kind = "group"]', style: { "background-opacity": 0.25, "border-style": "dashed", "border-color": colors.dim, color: colors.dim, "background-color": colors.raised } },
      { selector: "node:parent", style: { "text-valign": "top", "text-margin-y": -4 } },
      { selector: "node[?suspended]", style: { "background-color": colors.raised, color: colors.dim, "border-style": "dotted" } },
      { selector: "node[?dropping]", style: { "border-color": colors.bad } },
      {
        selector: "edge",
        style: {
          width: 1.5, "curve-style": this._many ? "straight" : "bezier", events: this._many ? "no" : "yes", "target-arrow-shape": "triangle", "line-color": colors.dim, "target-arrow-color": colors.dim,
          label: "data(label)", "font-size": 10, color: colors.text, "text-background-color": colors.surface, "text-background-opacity": 0.85,
        },
      },
      { selector: 'edge[relation = "calls"], edge[relation = "serves"]', style: { "line-style": "dotted" } },
      { selector: "edge[?dropping], edge[?mismatch]", style: { "line-color": colors.bad, "target-arrow-color": colors.bad, color: colors.bad } },
      { selector: "edge[?mismatch]", style: { "line-style": "dashed" } },
      { selector: ":selected", style: { "border-width": 4, width: (/** @type {any} */ element) => (element.isEdge() ? 3 : sizeOf(element.data("label")).width) } },
    ];
    this._cy.style(style);
  }

  _palette() {
    const probe = h("span");
    this._drawing.append(probe);
    /** @param {string} name */
    const color = (name) => {
      probe.style.color = `var(--${name})`;
      return getComputedStyle(probe).color;
    };
    const found = {
      surface: color("surface"), raised: color("raised"), text: color("text"), dim: color("dim"), accent: color("accent"),
      onAccent: color("on-accent"), good: color("good"), warn: color("warn"), bad: color("bad"),
    };
    probe.remove();
    return found;
  }

  /** @param {"svg" | "png"} kind */
  _save(kind) {
    const colors = this._palette();
    if (kind === "png") {
      download("graph.png", this._cy.png({ output: "blob", full: true, scale: 2, bg: colors.surface }), "image/png");
    } else {
      const shapes = this._cy.nodes().map((/** @type {any} */ node) => {
        const { x1, y1, w, h: height } = node.boundingBox({ includeLabels: node.isParent(), includeOverlays: false });
        const isNode = node.data("kind") === "node";
        return {
          x: x1 + w / 2, y: y1 + height / 2, width: w, height, label: node.data("label"), group: node.isParent(),
          round: node.data("kind") === "topic", color: isNode ? colors.accent : colors.dim,
          fill: isNode && !node.data("suspended") ? colors.accent : colors.raised,
          text: isNode && !node.data("suspended") ? colors.onAccent : colors.text,
        };
      });
      const arrows = this._cy.edges().map((/** @type {any} */ edge) => ({
        from: edge.sourceEndpoint(), to: edge.targetEndpoint(), label: edge.data("label"),
        color: edge.data("mismatch") || edge.data("dropping") ? colors.bad : colors.dim, dashed: Boolean(edge.data("mismatch")),
      }));
      download("graph.svg", svgOf(shapes, arrows, colors.surface), "image/svg+xml");
    }
  }
}

/**
 * Return the outermost namespace of a vertex.
 *
 * @param {string} id
 */
function blockOf(id) {
  const name = id.slice(id.indexOf(" ") + 1);
  const end = name.indexOf("/", 1);
  return end < 0 ? "/" : name.slice(0, end);
}

/**
 * Return the size of a vertex with a label.
 *
 * @param {string} label
 */
function sizeOf(label) {
  const lines = label.split("\n");
  return { width: Math.max(60, 26 + 7 * Math.max(...lines.map((line) => line.length))), height: 22 + 14 * lines.length };
}
