// @ts-check
// What names and types tell: which are hidden or standard, and which services belong to actions.

const STANDARD = /^(rcl_interfaces|lifecycle_msgs|type_description_interfaces|callboard_interfaces)\/srv\//;
const SEND_GOAL = "/_action/send_goal";

/** @typedef {{name: string, types: string[], servers: number, clients: number, owed_calls: number | null}} Row */

/**
 * Return whether a part of a name begins with `_`, which hides it.
 *
 * @param {string} name
 */
export function isHidden(name) {
  return /(^|\/)_/.test(name);
}

/**
 * Return whether every node, or every lifecycle node, has such a service.
 *
 * @param {Row} row
 */
export function isStandard(row) {
  return row.types.length > 0 && row.types.every((type) => STANDARD.test(type));
}

/**
 * Return the actions among services, by name.
 *
 * @param {Row[]} services
 * @returns {Record<string, Row>}
 */
export function actionsAmong(services) {
  const goals = services.filter((row) => row.name.endsWith(SEND_GOAL));
  return Object.fromEntries(
    goals.map((row) => {
      const name = row.name.slice(0, -SEND_GOAL.length);
      return [name, { ...row, name, types: row.types.map((type) => type.replace(/_SendGoal$/, "")) }];
    }),
  );
}
