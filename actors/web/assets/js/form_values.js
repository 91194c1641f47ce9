// @ts-check
// What people write into a form, and what of it fits a field. Without the page, so that it can be tested alone.

/**
 * A field, as actors/web/forms.py describes it.
 * @typedef {object} Field
 * @property {string} name
 * @property {string} type as in the definition
 * @property {"boolean" | "integer" | "number" | "text" | "message"} kind
 * @property {string} [message] the type whose fields it has
 * @property {number | bigint} [minimum]
 * @property {number | bigint} [maximum]
 * @property {number} [max_length]
 * @property {{low: number, high: number | null}} [array]
 * @property {{name: string, value: any}[]} [choices]
 * @property {any} [default]
 * @property {boolean} [required]
 * @property {string} [comment]
 */

/** A text that does not fit; its message says what would. */
export class ValueError extends Error {}

/**
 * Return the value of a text.
 *
 * @param {Field} field a number or a text
 * @param {string} text
 * @returns {any}
 */
export function valueOf(field, text) {
  if (field.kind === "integer") {
    return integerOf(field, text.trim());
  }
  if (field.kind === "number") {
    return numberOf(text.trim());
  }
  if (field.max_length !== undefined && [...text].length > field.max_length) {
    throw new ValueError(`at most ${field.max_length} characters`);
  }
  return text;
}

/**
 * Return the values of a text with numbers separated by commas, spaces or lines.
 *
 * @param {Field} field a sequence of numbers
 * @param {string} text
 * @returns {any[]}
 */
export function valuesOf(field, text) {
  const values = text
    .replace(/[[\],;]/g, " ")
    .split(/\s+/)
    .filter(Boolean)
    .map((item) => valueOf(field, item));
  const { low, high } = field.array ?? { low: 0, high: null };
  if (values.length < low || (high !== null && values.length > high)) {
    throw new ValueError(`${low === high ? low : `${low} to ${high}`} elements, not ${values.length}`);
  }
  return values;
}

/**
 * Return the value of a new field.
 *
 * @param {Field} field
 * @returns {any}
 */
export function initialOf(field) {
  if (field.default !== undefined) {
    return field.default;
  }
  if (field.array) {
    const element = { ...field, array: undefined };
    return Array.from({ length: field.array.low }, () => initialOf(element));
  }
  return { boolean: false, integer: 0, number: 0, text: "", message: {} }[field.kind];
}

/**
 * @param {Field} field
 * @param {string} text
 */
function integerOf(field, text) {
  const { minimum = 0, maximum = 0 } = field;
  const match = /^([+-]?)(0x[\da-f]+|\d+)$/i.exec(text);
  const value = match && (match[1] === "-" ? -BigInt(match[2]) : BigInt(match[2]));
  if (value === null || value < minimum || value > maximum) {
    throw new ValueError(`an integer from ${minimum} to ${maximum}`);
  }
  return Number.isSafeInteger(Number(value)) ? Number(value) : value;
}

/** @param {string} text */
function numberOf(text) {
  if (/^[+-]?(nan|inf|infinity)$/i.test(text)) {
    return text;
  }
  const value = Number(text);
  if (!text || !Number.isFinite(value)) {
    throw new ValueError("a number, nan or inf");
  }
  return value;
}
