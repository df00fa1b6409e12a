// @ts-check
// What the parts of the operator's page share.

/** @typedef {Record<string, any>} Status */

/**
 * What the configuration says and the loop does not tell.
 * @typedef {object} Facts
 * @property {number} hold_operator_s
 * @property {boolean} probed
 * @property {Record<string, {acts: boolean, largest_um: number, largest_rate_um_per_s: number}>} touched
 * @property {string} model_sha256
 * @property {Record<string, Record<string, {points: [number, number][], tool_gain: number}>>} gains
 */

/** @type {Facts} */
export const facts = JSON.parse(document.getElementById("operator-facts")?.textContent ?? "{}");

const NEAR_ZERO = 1e-9;

/** Whether a person has added something to a correction. @param {any} axis */
export function isTrimmed(axis) {
  return Math.abs(axis?.trim_um ?? 0) > NEAR_ZERO;
}

/** Whether touches are looked at. @param {any} axis */
export function isTouched(axis) {
  return typeof axis?.offset_um === "number";
}

/** What the model alone asks for, before limits and without a trim. @param {any} axis
 * @returns {number | null} */
export function modelAsksUm(axis) {
  const { weight, model_um: modelUm } = axis;
  return typeof weight === "number" && typeof modelUm === "number" ? -weight * modelUm : null;
}

/** Gain of a part at a diameter; null for a part without gains, or of a model that is not known.
 * @param {Status} status @param {string} output @param {string} part @returns {number | null} */
export function gainNow(status, output, part) {
  const known = status.model_sha256 === facts.model_sha256;
  const gains = known ? facts.gains[output]?.[part] : undefined;
  return gains ? gainAt(gains, status.diameter_mm) : null;
}

/** Linear between the stated diameters, their end values outside.
 * @param {{points: [number, number][], tool_gain: number}} gains @param {number | null} diameterMm */
export function gainAt({ points, tool_gain: toolGain }, diameterMm) {
  const [first, last] = [points[0], points.at(-1)];
  if (diameterMm === null || !first || !last) return toolGain;
  if (diameterMm <= first[0]) return first[1];
  for (let k = 1; k < points.length; k += 1) {
    const [low, high] = [points[k - 1] ?? first, points[k] ?? last];
    if (diameterMm > high[0]) continue;
    return low[1] + ((diameterMm - low[0]) / (high[0] - low[0])) * (high[1] - low[1]);
  }
  return last[1];
}
