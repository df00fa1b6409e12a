// @ts-check
// When the loop's status shows that a request is in effect, from what was asked alone: a page that
// is loaded anew can go on watching it.

import { word } from "../words.js";

/** @typedef {Record<string, any>} Status */
/**
 * @typedef {object} Asked
 * @property {string} method
 * @property {(string | number)[]} args
 * @property {string | null} [sha256] hash of a model's file; null where the screen cannot read it
 * @property {string} person name under which it was asked
 * @property {number} number the loop's number when it was asked
 * @property {string} model file and hash of the model in force when it was asked
 */

const HELD = ["operator_hold", "hold_expired"];
const SETTLING = "settling";
const MISMATCHES = ["offset_mismatch", "another_writer"];
const NEAR_ZERO_UM = 0.05;
const HALF_A_STEP_UM = 0.5; // of a control that keeps its offset in whole micrometres
const SAME = 1e-6;
const OVERRUN = 0.1; // by such a part cycles may last longer than they should
const ROUNDED_S = 2; // of the status that the page saw as it was asked, and of the time that is left

/** What a sensor's quality is called whose value waits for a person's word. */
export const JUMPED = "too_fast";

/**
 * Alarms of offsets that were not where the compensation had left them: they wait for a person.
 * @param {Status} status
 * @returns {any[]}
 */
export function foundElsewhere(status) {
  return status.alarms.filter((/** @type {any} */ one) => MISMATCHES.includes(one.code));
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
  Trim: (status, asked) => {
    const [output, value] = asked.args;
    const axis = status.outputs[String(output)];
    if (!axis || Math.abs(axis.trim_um - Number(value)) > SAME) return false;
    const active = status.state === "Active";
    if (value === 0) return !active || arrived(axis, axis.wanted_um); // elsewhere nothing moves
    return active && isTrimAsked(status, axis, asked) && arrived(axis, axis.wanted_um);
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
  if (asked.method !== "ChooseModel") return "";
  if (isNotKnown(status, asked)) return word("operator-effective_unknown");
  if (!isLoaded(status, asked)) return "";
  return status.reasons.includes(SETTLING)
    ? word("ask-model_settles") : word("ask-model_waits");
}

/** File and hash of the model in force. @param {Status | null} status */
export function modelOf(status) {
  return status ? `${status.model_file} ${status.model_sha256}` : "";
}

/** @param {Status} status @param {Asked} asked */
function isLoaded(status, asked) {
  if (status.model_file !== asked.args[0] || isNotKnown(status, asked)) return false;
  return !asked.sha256 || status.model_sha256 === asked.sha256;
}

/** Whether a model of the name that is in force already may have been read anew, or not.
 * @param {Status} status @param {Asked} asked */
function isNotKnown(status, { args: [file], sha256, model }) {
  return !sha256 && status.model_file === file && modelOf(status) === model;
}

/**
 * Whether a trim is the one that was asked for: that person's, with the time that is left of it.
 * @param {Status} status
 * @param {any} axis
 * @param {Asked} asked
 */
function isTrimAsked(status, axis, { args: [, , seconds], person, number }) {
  const passedS = (status.number - number) * status.cycle_s;
  const leastS = Number(seconds) - (1 + OVERRUN) * passedS - ROUNDED_S - status.cycle_s;
  return axis.trim_owner === person
    && axis.trim_left_s > leastS && axis.trim_left_s <= Number(seconds) + SAME;
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
