// @ts-check
// JSON with the integers of 64 bits that messages have: beyond 2^53 they are BigInts here, and digits on the wire.

/**
 * Parse JSON; integers that a number cannot hold become BigInts, where the browser gives `context.source`.
 *
 * @param {string} text
 * @returns {any}
 */
export function parseExact(text) {
  /** @type {(key: string, value: any, context?: {source?: string}) => any} */
  const revive = (_key, value, context) => {
    const digits = typeof value === "number" && !Number.isSafeInteger(value) ? context?.source : undefined;
    return digits !== undefined && /^-?\d+$/.test(digits) ? BigInt(digits) : value;
  };
  return JSON.parse(text, /** @type {(key: string, value: any) => any} */ (revive));
}

/**
 * Return a value as JSON; undefined members are left out.
 *
 * @param {unknown} value
 * @param {string} [indent] of each level; without it all is in one line
 * @param {string} [margin] before the closing bracket
 * @returns {string}
 */
export function stringifyExact(value, indent = "", margin = "") {
  if (typeof value === "bigint") {
    return value.toString();
  }
  if (typeof value !== "object" || value === null) {
    return JSON.stringify(value) ?? "null";
  }
  const inner = margin + indent;
  const parts = Array.isArray(value)
    ? value.map((item) => stringifyExact(item, indent, inner))
    : Object.entries(value)
        .filter(([, item]) => item !== undefined)
        .map(([name, item]) => `${JSON.stringify(name)}:${indent && " "}${stringifyExact(item, indent, inner)}`);
  const [open, close] = Array.isArray(value) ? "[]" : "{}";
  if (!parts.length || !indent) {
    return open + parts.join(",") + close;
  }
  return `${open}\n${inner}${parts.join(`,\n${inner}`)}\n${margin}${close}`;
}
