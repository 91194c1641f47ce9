// @ts-check
// Makes elements without parsing HTML, so that names, messages and log lines only ever become text nodes.

/** @typedef {Node | string | number | null | undefined | false} Child */

/**
 * Make an element.
 *
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {Record<string, unknown>} [attributes] functions under `on...` become listeners; true becomes an
 *   attribute without a value; false, null and undefined are left out
 * @param {...Child} children
 * @returns {HTMLElementTagNameMap[K]}
 */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") {
      element.addEventListener(name.slice(2), /** @type {EventListener} */ (value));
    } else if (value !== false && value !== null && value !== undefined) {
      element.setAttribute(name, value === true ? "" : String(value));
    }
  }
  add(element, ...children);
  return element;
}

/**
 * Append children; empty ones are left out.
 *
 * @param {Element} parent
 * @param {...Child} children
 */
export function add(parent, ...children) {
  for (const child of children) {
    if (child !== null && child !== undefined && child !== false) {
      parent.append(child instanceof Node ? child : String(child));
    }
  }
}

/**
 * Replace the content of an element if it is not the same text already.
 *
 * @param {Element} element
 * @param {string} text
 */
export function setText(element, text) {
  if (element.textContent !== text) {
    element.textContent = text;
  }
}

/**
 * Replace the children of an element; those that are equal stay, so that they keep the focus and no click misses.
 *
 * @param {Element} parent
 * @param {...Child} children
 */
export function setChildren(parent, ...children) {
  const wanted = [...h("div", {}, ...children).childNodes];
  wanted.forEach((child, number) => {
    const old = parent.childNodes[number];
    if (!old) {
      parent.append(child);
    } else if (!old.isEqualNode(child)) {
      old.replaceWith(child);
    }
  });
  while (parent.childNodes.length > wanted.length) {
    parent.lastChild?.remove();
  }
}

/**
 * Let the browser save a file.
 *
 * @param {string} name
 * @param {BlobPart} content
 * @param {string} type such as "text/csv"
 */
export function download(name, content, type) {
  const url = URL.createObjectURL(new Blob([content], { type }));
  h("a", { download: name, href: url }).click();
  setTimeout(() => URL.revokeObjectURL(url));
}

/**
 * Make screen readers say something.
 *
 * @param {string} text
 */
export function announce(text) {
  const region = document.getElementById("announcements");
  if (region) {
    region.textContent = text;
  }
}

/**
 * Call a function when the page gets other colors: those of the system, or chosen ones.
 *
 * @param {() => void} listener
 * @returns {() => void} ends it
 */
export function onOtherColors(listener) {
  const system = matchMedia("(prefers-color-scheme: dark)");
  system.addEventListener("change", listener);
  const chosen = new MutationObserver(listener);
  chosen.observe(document.documentElement, { attributeFilter: ["data-theme"] });
  return () => {
    system.removeEventListener("change", listener);
    chosen.disconnect();
  };
}
