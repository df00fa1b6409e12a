// @ts-check
// When the loop's status shows that a request is in effect, from what was asked alone: a page that
// is loaded anew can go on watching it.

import { word } from "./words.js";

/** @typedef {Record<string, any>} Status */
/**
 * @typedef {object} Asked
 * @property {string} method
 * @property {(string | number)[]} args
 * @property {string | null} [sha256] hash of a model's file; null where the screen cannot read it
 */

const HELD = ["an operator holds it", "it was held for as long as it may be"];
const SETTLING = "the model has not run for long enough";
const NEAR_ZERO_UM = 0.05;
const HALF_A_STEP_UM = 0.5; // of a control that keeps its offset in whole micrometres
const SAME = 1e-6;

/** What a sensor's quality is called whose value waits for a person's word. */
export const JUMPED = "the value jumped";

/**
 * Alarms of offsets that were not where the compensation had left them: they wait for a person.
 * @param {Status} status
 * @returns {any[]}
 */
export function foundElsewhere(status) {
  return status.alarms.filter((/** @type {any} */ one) => one.code === "found_elsewhere");
}

/** @param {Status} status */
export function isHeld(status) {
  return status.reasons.some((/** @type {string} */ one) => HELD.includes(one));
}

/** @param {number | null | undefined} um */
export function isZero(um) {
  return Math.abs(um ?? 0) < NEAR_ZERO_UM;
}

/** @type {Record<string, (status: Status, asked: Asked) => boolean>} */
const EFFECTS = {
  Enable: (status) => status.state === "Active",
  Disable: (status) => status.state === "Off"
    && Object.values(status.outputs).every((axis) => arrived(axis, 0)),
  Hold: isHeld,
  Resume: (status) => !isHeld(status),
  Acknowledge: (status) => status.state !== "Fault" && foundElsewhere(status).length === 0
    && Object.values(status.inputs).every((input) => input.quality !== JUMPED),
  Trim: (status, { args: [output, value] }) => {
    const axis = status.outputs[String(output)];
    if (!axis || Math.abs(axis.trim_um - Number(value)) > SAME) return false;
    return status.state === "Active" && arrived(axis, axis.wanted_um);
  },
  Diameter: (status, { args: [value] }) => status.diameter_mm === value,
  NoDiameter: (status) => status.diameter_mm === null,
  // It acts once the compensation follows it: until it has settled nothing moves.
  ChooseModel: (status, asked) => isLoaded(status, asked) && status.state === "Active"
    && !status.reasons.includes(SETTLING),
};

/**
 * Whether a status shows that what was asked is in effect.
 * @param {Status} status
 * @param {Asked} asked
 */
export function acts(status, asked) {
  return EFFECTS[asked.method]?.(status, asked) ?? false;
}

/**
 * How far it came where it does not act yet, in words; empty where nothing is known.
 * @param {Status} status
 * @param {Asked} asked
 */
export function stageOf(status, asked) {
  if (asked.method !== "ChooseModel" || !isLoaded(status, asked)) return "";
  return status.reasons.includes(SETTLING)
    ? word("ask.model_settles") : word("ask.model_waits");
}

/** @param {Status} status @param {Asked} asked */
function isLoaded(status, { args: [file], sha256 }) {
  return status.model_file === file && (!sha256 || status.model_sha256 === sha256);
}

/**
 * Whether a correction, and what acts of it in the machine where that is told, is at a value.
 * @param {any} axis
 * @param {number} um
 */
function arrived(axis, um) {
  const deadband = axis.limits?.deadband_um ?? 0;
  const now = axis.effective_um ?? axis.accepted_um ?? axis.correction_um ?? 0;
  return Math.abs((axis.correction_um ?? 0) - um) <= deadband + NEAR_ZERO_UM
    && Math.abs(now - um) <= Math.max(deadband, HALF_A_STEP_UM) + NEAR_ZERO_UM;
}
