// @ts-check
// Numbers and names for people.

const UNITS = ["", "k", "M", "G", "T"];

/**
 * Return a number with three digits and a unit, such as "1.23 M"; "-" for none.
 *
 * @param {number | null | undefined} value
 * @param {number} [step] 1000, or 1024 for sizes
 */
export function short(value, step = 1000) {
  if (value === null || value === undefined || Number.isNaN(value)) {
    return "-";
  }
  let unit = 0;
  while (rounded(value) >= step && unit < UNITS.length - 1) {
    value /= step;
    unit += 1;
  }
  const digits = rounded(value) >= 100 || Number.isInteger(value) ? 0 : rounded(value) >= 10 ? 1 : 2;
  return `${value.toFixed(digits)}${unit ? ` ${UNITS[unit]}` : ""}`;
}

/** @param {number} value its size is returned as it is shown */
function rounded(value) {
  return Math.abs(value) >= 1000 ? Math.abs(value) : Math.abs(Number(value.toPrecision(3)));
}

/** @param {number | null | undefined} value bytes */
export function bytes(value) {
  const text = short(value, 1024);
  return text === "-" ? text : /[kMGT]$/.test(text) ? `${text.replace("k", "K")}iB` : `${text} B`;
}

/**
 * Return a node's labels in one line; empty without any.
 *
 * @param {Record<string, string> | null | undefined} labels
 */
export function labelsText(labels) {
  return Object.entries(labels ?? {}).map(([name, text]) => `${name}=${text}`).join(", ");
}

/**
 * @param {number | null | undefined} seconds
 * @returns {string}
 */
export function duration(seconds) {
  if (seconds === null || seconds === undefined) {
    return "-";
  }
  if (seconds < 0) {
    return `-${duration(-seconds)}`; // between clocks of two computers
  }
  if (seconds < 0.9995e-3) {
    return `${(seconds * 1e6).toFixed(0)} µs`;
  }
  if (seconds < 0.99995) {
    return `${(seconds * 1e3).toFixed(1)} ms`;
  }
  if (seconds < 59.95) {
    return `${seconds.toFixed(1)} s`;
  }
  const minutes = Math.floor(Math.round(seconds) / 60);
  return minutes < 60 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

const CLOCK = new Intl.DateTimeFormat(undefined, {
  hour: "2-digit", minute: "2-digit", second: "2-digit", fractionalSecondDigits: 3, hour12: false,
});

/** @param {number} nanoseconds since the epoch */
export function clock(nanoseconds) {
  return CLOCK.format(new Date(nanoseconds / 1e6));
}

/** @param {Record<string, any>} qos */
export function qosText(qos) {
  const depth = qos.history === "keep_last" ? ` ${qos.depth}` : "";
  const limits = [["deadline", qos.deadline_ns], ["lifespan", qos.lifespan_ns], ["lease", qos.liveliness_lease_duration_ns]];
  const shown = limits.filter(([, value]) => value).map(([text, value]) => `${text} ${duration(value / 1e9)}`);
  return [`${qos.history}${depth}`, qos.reliability, qos.durability, qos.strict && "strict", ...shown].filter(Boolean).join(", ");
}
