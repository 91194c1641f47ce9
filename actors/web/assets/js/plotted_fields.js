// @ts-check
// Which fields are plotted: kept for this tab, so that several topics can be put into one plot.

const KEY = "callboard-plotted";

/** @typedef {{topic: string, field: string}} PlottedField */

/** @returns {PlottedField[]} */
export function plottedFields() {
  try {
    return JSON.parse(sessionStorage.getItem(KEY) ?? "[]");
  } catch {
    return [];
  }
}

/**
 * @param {string} topic
 * @param {string} field
 */
export function isPlotted(topic, field) {
  return plottedFields().some((each) => each.topic === topic && each.field === field);
}

/**
 * Plot a field, or not any more.
 *
 * @param {string} topic
 * @param {string} field
 */
export function togglePlotted(topic, field) {
  const others = plottedFields().filter((each) => each.topic !== topic || each.field !== field);
  const fields = isPlotted(topic, field) ? others : [...others, { topic, field }];
  sessionStorage.setItem(KEY, JSON.stringify(fields));
}
