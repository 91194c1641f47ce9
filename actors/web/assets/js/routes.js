// @ts-check
// The addresses of the page's views, in the fragment: `#/topic/%2Fchatter`.

/**
 * Return the address of something in a view.
 *
 * @param {string} view
 * @param {string} [name] what of the view, such as a topic's full name
 */
export function addressOf(view, name = "") {
  return name ? `#/${view}/${encodeURIComponent(name)}` : `#/${view}`;
}

/**
 * Return the view and the name in an address.
 *
 * @param {string} hash
 * @returns {{view: string, name: string}}
 */
export function readAddress(hash) {
  const [, view = "", name = ""] = /^#\/(\w+)(?:\/(.*))?$/.exec(hash) ?? [];
  try {
    return { view, name: decodeURIComponent(name) };
  } catch {
    return { view, name: "" };
  }
}
