// @ts-check
// A sortable table whose rows have keys: rows that stay keep their elements, so that a click never misses.

import { h, setText } from "./dom.js";

/**
 * @template Row
 * @typedef {object} Column
 * @property {string} title
 * @property {(row: Row) => string | number | null | undefined} value what is sorted by, and shown without `text`
 * @property {(row: Row) => string} [text] what is shown
 * @property {(row: Row) => string} [href] makes it a link
 * @property {(row: Row) => string} [badge] with a link, what stands beside it
 * @property {(row: Row) => string} [style] a class of the cell
 * @property {boolean} [number] whether it is a number: aligned right, the greatest first
 */

/** Rows that are shown until the user wants all of them: thousands take longer than a click may. */
const ROWS_AT_FIRST = 200;

/** @template Row */
export class Table {
  /**
   * @param {string} caption for screen readers
   * @param {Column<Row>[]} columns
   */
  constructor(caption, columns) {
    this._columns = columns;
    this._sorted = 0;
    this._reversed = false;
    /** @type {Map<string, HTMLTableRowElement>} */
    this._elements = new Map();
    /** @type {Record<string, Row>} */
    this._rows = {};
    this._headings = columns.map((column, number) =>
      h(
        "th",
        { scope: "col", class: column.number ? "number" : null },
        h("button", { type: "button", onclick: () => this._sortBy(number) }, column.title),
      ),
    );
    this._body = h("tbody");
    const table = h("table", {}, h("caption", { class: "hidden-text" }, caption), h("thead", {}, h("tr", {}, ...this._headings)), this._body);
    this._empty = h("p", { class: "dim", hidden: true }, `No ${caption.toLowerCase()} are shown.`);
    this._limit = ROWS_AT_FIRST;
    this._more = h("button", { type: "button", hidden: true, onclick: () => this._showAll() });
    this.element = h("div", { class: "table", tabindex: "0", role: "region", "aria-label": caption }, table, this._more, this._empty);
    this._markSorted();
  }

  /**
   * Show rows.
   *
   * @param {Record<string, Row>} rows by key
   */
  show(rows) {
    this._rows = rows;
    const order = this._order();
    const shown = new Set(order.slice(0, this._limit));
    this._more.hidden = shown.size === order.length;
    setText(this._more, `Show all ${order.length} rows`);
    this._empty.hidden = order.length > 0;
    for (const [key, element] of this._elements) {
      if (!shown.has(key)) {
        element.remove();
        this._elements.delete(key);
      }
    }
    const focused = document.activeElement;
    let before = null;
    for (const key of shown) {
      const element = this._filled(key);
      /** @type {ChildNode | null} */
      const next = before === null ? this._body.firstChild : before.nextSibling;
      if (element !== next) {
        this._body.insertBefore(element, next);
      }
      before = element;
    }
    if (focused instanceof HTMLElement && focused !== document.activeElement && this._body.contains(focused)) {
      focused.focus({ preventScroll: true }); // its row has moved
    }
  }

  /** @param {string} key */
  _filled(key) {
    let element = this._elements.get(key);
    if (!element) {
      element = h("tr", {}, ...this._columns.map((column) => h("td", { class: column.number ? "number" : null }, column.href ? h("a") : null, column.badge ? h("span", { class: "badge" }) : null)));
      this._elements.set(key, element);
    }
    const row = this._rows[key];
    this._columns.forEach((column, number) => {
      const cell = /** @type {HTMLElement} */ (element.children[number]);
      const link = column.href ? /** @type {HTMLAnchorElement} */ (cell.firstChild) : null;
      if (link && column.href && link.getAttribute("href") !== column.href(row)) {
        link.setAttribute("href", column.href(row));
      }
      if (link && column.badge) {
        setText(/** @type {HTMLElement} */ (cell.lastChild), column.badge(row));
      }
      setText(link ?? cell, column.text ? column.text(row) : String(column.value(row) ?? "-"));
      if (column.style) {
        cell.className = `${column.number ? "number " : ""}${column.style(row)}`;
      }
    });
    return element;
  }

  _order() {
    const { value, number } = this._columns[this._sorted];
    const sign = (this._reversed ? -1 : 1) * (number ? -1 : 1);
    const missing = number ? -Infinity : "";
    return Object.keys(this._rows)
      .map((key) => /** @type {const} */ ([value(this._rows[key]) ?? missing, key]))
      .sort(([a, one], [b, other]) => (a < b ? -sign : a > b ? sign : one < other ? -1 : 1))
      .map(([, key]) => key);
  }

  _showAll() {
    this._limit = Infinity;
    this.show(this._rows);
  }

  /** @param {number} column */
  _sortBy(column) {
    this._reversed = column === this._sorted && !this._reversed;
    this._sorted = column;
    this._markSorted();
    this.show(this._rows);
  }

  _markSorted() {
    this._headings.forEach((heading, number) => {
      const up = Boolean(this._columns[number].number) === this._reversed;
      heading.setAttribute("aria-sort", number !== this._sorted ? "none" : up ? "ascending" : "descending");
    });
  }
}
