// @ts-check
// A drawing of a graph as an SVG document.

const SVG = "http://www.w3.org/2000/svg";
const MARGIN = 20;

/**
 * @typedef {object} Shape
 * @property {number} x of its centre
 * @property {number} y
 * @property {number} width
 * @property {number} height
 * @property {string} label lines
 * @property {boolean} round
 * @property {boolean} group
 * @property {string} color of the line
 * @property {string} fill
 * @property {string} text
 */
/** @typedef {{from: {x: number, y: number}, to: {x: number, y: number}, label: string, color: string, dashed: boolean}} Arrow */

/**
 * Return an SVG document.
 *
 * @param {Shape[]} shapes groups first
 * @param {Arrow[]} arrows
 * @param {string} background
 */
export function svgOf(shapes, arrows, background) {
  const left = Math.min(...shapes.map(({ x, width }) => x - width / 2)) - MARGIN;
  const top = Math.min(...shapes.map(({ y, height }) => y - height / 2)) - MARGIN;
  const right = Math.max(...shapes.map(({ x, width }) => x + width / 2)) + MARGIN;
  const bottom = Math.max(...shapes.map(({ y, height }) => y + height / 2)) + MARGIN;
  const view = `${left} ${top} ${right - left} ${bottom - top}`;
  const root = make("svg", { xmlns: SVG, viewBox: view, "font-family": "sans-serif", "font-size": 12 });
  root.append(make("rect", { x: left, y: top, width: right - left, height: bottom - top, fill: background }));
  for (const shape of shapes.filter(({ group }) => group)) {
    root.append(...shapeElements(shape));
  }
  for (const { from, to, label, color, dashed } of arrows) {
    root.append(make("path", { d: `M${from.x} ${from.y}L${to.x} ${to.y}`, stroke: color, fill: "none", "stroke-dasharray": dashed ? "5 4" : "none" }));
    root.append(head(from, to, color));
    if (label) {
      const text = make("text", { x: (from.x + to.x) / 2, y: (from.y + to.y) / 2 - 4, "text-anchor": "middle", fill: color });
      text.textContent = label;
      root.append(text);
    }
  }
  for (const shape of shapes.filter(({ group }) => !group)) {
    root.append(...shapeElements(shape));
  }
  return new XMLSerializer().serializeToString(root);
}

/** @param {Shape} shape */
function shapeElements({ x, y, width, height, label, round, group, color, fill, text }) {
  const box = { x: x - width / 2, y: y - height / 2, width, height, rx: round ? height / 2 : 6, stroke: color, fill };
  const lines = label.split("\n");
  const texts = lines.map((line, number) => {
    const middle = group ? y - height / 2 + 14 : y + 4 + 15 * (number - (lines.length - 1) / 2);
    const element = make("text", { x, y: middle, "text-anchor": "middle", fill: text });
    element.textContent = line;
    return element;
  });
  return [make("rect", group ? { ...box, "stroke-dasharray": "5 4" } : box), ...texts];
}

/**
 * @param {{x: number, y: number}} from
 * @param {{x: number, y: number}} to
 * @param {string} color
 */
function head(from, to, color) {
  const turn = (Math.atan2(to.y - from.y, to.x - from.x) * 180) / Math.PI;
  return make("path", { d: "M0 0L-9 4L-9 -4Z", fill: color, transform: `translate(${to.x} ${to.y}) rotate(${turn})` });
}

/**
 * @param {string} tag
 * @param {Record<string, string | number>} attributes
 */
function make(tag, attributes) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name !== "xmlns") {
      element.setAttribute(name, String(value));
    }
  }
  return element;
}
