// @ts-check
// A form made from a message's type. What does not fit is said beside its field, and nothing is sent.

import { parseExact, stringifyExact } from "./exact_json.js";
import { ValueError, initialOf, valueOf, valuesOf } from "./form_values.js";
import { h, setText } from "./dom.js";

/** @typedef {import("./form_values.js").Field} Field */
/**
 * @typedef {object} Description
 * @property {string} type
 * @property {Record<string, Field[]>} types
 */
/**
 * A part of a form.
 * @typedef {object} Control
 * @property {HTMLElement} element
 * @property {() => any} read returns the value; undefined: the default. Throws a FormError
 * @property {(value: any) => void} write throws a ValueError if it cannot show the value
 */

/** What has been written does not fit; `element` is where. */
export class FormError extends Error {
  /**
   * @param {string} text
   * @param {HTMLElement} element
   */
  constructor(text, element) {
    super(text);
    this.element = element;
  }
}

const TIME = "builtin_interfaces/msg/Time";

/** Controls of a form from which on groups begin folded; they are made when they are opened. */
const MANY_CONTROLS = 150;

/** Elements of a sequence of numbers from which on it is one text. */
const MANY_ELEMENTS = 16;

let lastId = 0;

/** A form, with a switch to JSON. */
export class Form {
  /** @param {Description} description */
  constructor(description) {
    this._types = description.types;
    this._controls = 0;
    this._group = this._message(description.type, {});
    this._raw = h("textarea", { class: "mono", rows: "12", spellcheck: "false", "aria-label": "JSON", hidden: true });
    this._problem = h("p", { class: "bad", hidden: true });
    this._switch = h("button", { type: "button", "aria-pressed": "false", onclick: () => this._toggle() }, "As JSON");
    this.element = h("fieldset", { class: "form" }, h("legend", {}, description.type), this._group.element, this._raw, this._problem, this._switch);
  }

  /** Return what has been written. Throws a FormError, after it has said so beside the field. */
  read() {
    try {
      this._say("");
      return this._raw.hidden ? this._group.read() : this._parsed();
    } catch (error) {
      if (error instanceof FormError) {
        const folded = error.element.closest("details:not([open])");
        folded?.setAttribute("open", "");
        error.element.focus();
      }
      throw error;
    }
  }

  /** @param {boolean} disabled */
  setDisabled(disabled) {
    this.element.disabled = disabled;
  }

  _toggle() {
    const toRaw = this._raw.hidden;
    try {
      const value = this.read();
      if (toRaw) {
        this._raw.value = stringifyExact(value, "  ");
      } else {
        this._group.write(value);
      }
    } catch (error) {
      if (error instanceof ValueError) {
        this._say(`The form cannot show that: ${error.message}`);
      } else if (!(error instanceof FormError)) {
        throw error;
      }
      return;
    }
    this._raw.hidden = !toRaw;
    this._group.element.hidden = toRaw;
    this._switch.setAttribute("aria-pressed", String(toRaw));
  }

  _parsed() {
    let problem = "not a JSON object";
    try {
      const value = parseExact(this._raw.value);
      if (isObject(value)) {
        return value;
      }
    } catch (error) {
      problem = `not JSON: ${/** @type {Error} */ (error).message}`;
    }
    this._say(problem);
    throw new FormError(problem, this._raw);
  }

  /** @param {string} text */
  _say(text) {
    this._problem.hidden = !text;
    setText(this._problem, text);
  }

  /**
   * @param {string} type
   * @param {any} initial
   * @returns {Control}
   */
  _message(type, initial) {
    const element = h("div", { class: "fields" });
    /** @type {[string, Control][]} */
    const controls = [];
    for (const field of this._types[type]) {
      const own = Object.hasOwn(initial, field.name);
      const control = this._field(field, field.name, own ? initial[field.name] : initialOf(field), own);
      controls.push([field.name, control]);
      element.append(commented(control.element, field.comment));
    }
    if (!controls.length) {
      element.append(h("p", { class: "dim" }, "No fields."));
    }
    return {
      element,
      read: () => Object.fromEntries(controls.map(([name, control]) => /** @type {const} */ ([name, control.read()])).filter(([, value]) => value !== undefined)),
      write: (value) => {
        requireObject(value, type);
        const unknown = Object.keys(value).find((name) => !controls.some(([known]) => known === name));
        if (unknown !== undefined) {
          throw new ValueError(`${type} has no field ${unknown}`);
        }
        for (const [number, [name, control]] of controls.entries()) {
          control.write(Object.hasOwn(value, name) ? value[name] : initialOf(this._types[type][number]));
        }
      },
    };
  }

  /**
   * @param {Field} field
   * @param {string} label
   * @param {any} initial
   * @param {boolean} given whether `initial` is more than the type's default
   * @returns {Control}
   */
  _field(field, label, initial, given) {
    this._controls += 1;
    if (field.array) {
      const long = field.array.low > MANY_ELEMENTS || initial.length > MANY_ELEMENTS || /^(uint8|byte|char)\[/.test(field.type);
      const numbers = field.kind === "integer" || field.kind === "number";
      return long && numbers ? numbersControl(field, label, initial) : this._sequence(field, label, initial);
    }
    if (field.kind === "message") {
      const group = this._folded(field, label, initial, given || field.default !== undefined);
      return field.message === TIME ? withNow(group, label) : group;
    }
    return scalarControl(field, label, initial);
  }

  /**
   * A group of fields that is made when it is opened first: types may be deep, or contain each other.
   *
   * @param {Field} field
   * @param {string} label
   * @param {any} initial
   * @param {boolean} given
   * @returns {Control}
   */
  _folded(field, label, initial, given) {
    const type = /** @type {string} */ (field.message);
    /** @type {Control | null} */
    let group = null;
    const make = () => {
      if (group === null) {
        group = this._message(type, initial);
        element.append(group.element);
      }
      return group;
    };
    const element = h("details", { ontoggle: () => element.open && make() }, h("summary", {}, label, " ", h("span", { class: "dim" }, field.type)));
    if (field.required || this._controls < MANY_CONTROLS) {
      this._controls += this._types[type].length;
      element.open = true;
      if (this._controls < MANY_CONTROLS) {
        make();
      }
    }
    return {
      element,
      read: () => (group ? group.read() : given ? initial : undefined),
      write: (value) => {
        requireObject(value, label);
        make().write(value);
      },
    };
  }

  /**
   * @param {Field} field
   * @param {string} label
   * @param {any[]} initial
   * @returns {Control}
   */
  _sequence(field, label, initial) {
    const { low, high } = /** @type {{low: number, high: number | null}} */ (field.array);
    const one = { ...field, array: undefined, default: undefined, type: field.type.replace(/\[[^\]]*\]$/, "") };
    const fixed = low === high;
    /** @type {{control: Control, row: HTMLElement, indexLabel: HTMLElement}[]} */
    const items = [];
    const list = h("div", { class: "fields" });
    const count = h("span", { class: "dim", role: "status" });
    const addButton = h("button", { type: "button", hidden: fixed, onclick: () => append(initialOf(one), true) }, `Add to ${label}`);
    const element = h("div", { role: "group", "aria-label": label }, h("div", {}, label, " ", h("span", { class: "dim" }, field.type), " ", count), list, addButton);
    const update = () => {
      setText(count, items.length === 1 ? "1 element" : `${items.length} elements`);
      addButton.disabled = high !== null && items.length >= high;
      items.forEach(({ row, indexLabel }, number) => {
        setText(indexLabel, `[${number}]`);
        row.setAttribute("aria-label", `${label}[${number}]`);
      });
    };
    /** @param {{control: Control, row: HTMLElement, indexLabel: HTMLElement}} item */
    const remove = (item) => {
      items.splice(items.indexOf(item), 1);
      item.row.remove();
      update();
      addButton.focus();
    };
    /**
     * @param {any} value
     * @param {boolean} [focus]
     */
    const append = (value, focus = false) => {
      const control = this._field(one, "element", value, true);
      const indexLabel = h("span", { class: "dim" });
      const item = { control, indexLabel, row: h("div", { class: "element", role: "group" }, indexLabel, control.element) };
      if (!fixed) {
        item.row.append(h("button", { type: "button", "aria-label": `Remove this element of ${label}`, onclick: () => remove(item) }, "Remove"));
      }
      items.push(item);
      list.append(item.row);
      update();
      if (focus) {
        /** @type {HTMLElement | null} */ (item.row.querySelector("input, select, textarea, summary"))?.focus();
      }
    };
    update();
    initial.forEach((value) => append(value));
    return {
      element,
      read: () => {
        const values = items.map(({ control }, number) => within(`${label}[${number}]`, () => control.read() ?? {}));
        if (values.length < low) {
          throw new FormError(`${label}: at least ${low} elements`, addButton);
        }
        return values;
      },
      write: (value) => {
        if (!Array.isArray(value) || value.length < low || (high !== null && value.length > high)) {
          throw new ValueError(`${label} is not ${field.type}`);
        }
        items.splice(0).forEach(({ row }) => row.remove());
        update();
        value.forEach((item) => append(item));
      },
    };
  }
}

/**
 * Add what the definition says about a field: behind its control, or below the heading of a group.
 *
 * @param {HTMLElement} element
 * @param {string | undefined} comment
 */
function commented(element, comment) {
  if (comment) {
    const note = h("span", { class: "comment dim" }, comment);
    if (element.matches(".field")) {
      element.append(note);
    } else {
      element.firstElementChild?.after(note);
    }
  }
  return element;
}

/**
 * @param {Field} field
 * @param {string} label
 * @param {any} initial
 * @returns {Control}
 */
function scalarControl(field, label, initial) {
  const id = `field-${++lastId}`;
  const boolean = field.kind === "boolean";
  const keyboard = { integer: "numeric", number: "decimal", boolean: null, text: null, message: null }[field.kind];
  const input = h("input", {
    id, type: boolean ? "checkbox" : "text", inputmode: keyboard, autocomplete: "off", "aria-describedby": `${id}-problem`,
  });
  const problem = h("span", { id: `${id}-problem`, class: "bad" });
  const choices = field.choices ? choiceOf(field, label, input) : null;
  const check = () => {
    try {
      const value = boolean ? input.checked : valueOf(field, input.value);
      setProblem(input, problem, "");
      return value;
    } catch (error) {
      setProblem(input, problem, /** @type {Error} */ (error).message);
      throw new FormError(`${label}: ${/** @type {Error} */ (error).message}`, input);
    }
  };
  input.addEventListener("change", () => quietly(check));
  /** @param {any} value */
  const write = (value) => {
    if (typeof value === "object") {
      throw new ValueError(`${label} is not ${field.type}`);
    }
    if (boolean) {
      input.checked = Boolean(value);
    } else {
      input.value = String(value);
    }
    choices?.dispatchEvent(new Event("refresh"));
    setProblem(input, problem, "");
  };
  write(initial);
  const hint = h("span", { class: "dim" }, field.type);
  return { element: h("div", { class: "field" }, h("label", { for: id }, label, " ", hint), input, choices, problem), read: check, write };
}

/**
 * Return a choice of constants, which writes into the input and follows it.
 *
 * @param {Field} field
 * @param {string} label
 * @param {HTMLInputElement} input
 */
function choiceOf(field, label, input) {
  const choices = field.choices ?? [];
  const select = h(
    "select",
    {
      "aria-label": `Constants for ${label}`,
      onchange: () => {
        input.value = select.value;
        input.dispatchEvent(new Event("change"));
      },
    },
    h("option", { value: "", disabled: true }, "another value"),
    ...choices.map(({ name, value }) => h("option", { value: String(value) }, `${name} = ${value}`)),
  );
  const follow = () => {
    select.value = choices.some(({ value }) => String(value) === input.value) ? input.value : "";
  };
  input.addEventListener("input", follow);
  select.addEventListener("refresh", follow);
  return select;
}

/**
 * @param {Field} field
 * @param {string} label
 * @param {any[]} initial
 * @returns {Control}
 */
function numbersControl(field, label, initial) {
  const id = `field-${++lastId}`;
  const input = h("textarea", { id, class: "mono", rows: "2", spellcheck: "false", "aria-describedby": `${id}-problem` });
  const problem = h("span", { id: `${id}-problem`, class: "bad" });
  const check = () => {
    try {
      const values = valuesOf(field, input.value);
      setProblem(input, problem, "");
      return values;
    } catch (error) {
      setProblem(input, problem, /** @type {Error} */ (error).message);
      throw new FormError(`${label}: ${/** @type {Error} */ (error).message}`, input);
    }
  };
  input.addEventListener("change", () => quietly(check));
  /** @param {any} value */
  const write = (value) => {
    if (!Array.isArray(value)) {
      throw new ValueError(`${label} is not ${field.type}`);
    }
    input.value = value.join(", ");
    setProblem(input, problem, "");
  };
  write(initial);
  const hint = h("span", { class: "dim" }, `${field.type}, numbers separated by commas`);
  return { element: h("div", { class: "field" }, h("label", { for: id }, label, " ", hint), input, problem), read: check, write };
}

/**
 * Return a time that may be that of sending.
 *
 * @param {Control} group
 * @param {string} label
 * @returns {Control}
 */
function withNow(group, label) {
  const now = h("input", { type: "checkbox", onchange: () => show() });
  const show = () => {
    group.element.hidden = now.checked;
  };
  return {
    element: h("div", {}, h("label", {}, now, ` ${label}: the time when it is sent`), group.element),
    read: () => (now.checked ? "now" : group.read()),
    write: (value) => {
      now.checked = value === "now";
      show();
      if (!now.checked) {
        group.write(value);
      }
    },
  };
}

/**
 * @param {HTMLElement} input
 * @param {HTMLElement} problem
 * @param {string} text
 */
function setProblem(input, problem, text) {
  input.toggleAttribute("aria-invalid", false);
  if (text) {
    input.setAttribute("aria-invalid", "true");
  }
  setText(problem, text);
}

/** @param {() => unknown} check */
function quietly(check) {
  try {
    check();
  } catch (error) {
    if (!(error instanceof FormError)) {
      throw error;
    }
  }
}

/**
 * Return what a function returns; say in its FormError which element of the sequence it is about.
 *
 * @param {string} name
 * @param {() => any} read
 */
function within(name, read) {
  try {
    return read();
  } catch (error) {
    throw error instanceof FormError ? new FormError(`${name} ${error.message}`, error.element) : error;
  }
}

/** @param {unknown} value */
function isObject(value) {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

/**
 * @param {unknown} value
 * @param {string} label
 */
function requireObject(value, label) {
  if (!isObject(value)) {
    throw new ValueError(`${label} is not an object`);
  }
}
