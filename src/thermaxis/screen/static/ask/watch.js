// @ts-check
// How far each request came, by every status that the loop tells, until it is in effect or nobody
// can say any more that it is this request which the status shows.

import { acts, stageOf } from "./effects.js";

/** @typedef {import("./ask.js").Course} Course */
/** @typedef {Record<string, any>} Status */

/** A request is watched for so long after its answer. */
export const LATE_MS = 15 * 60 * 1000;

/** Why a request is watched no more; empty while it is. */
export const ENDS = ["", "replaced", "restarted", "late", "unseen"];

const WATCHED = ["accepted", "unknown"];
const DIAMETERS = ["Diameter", "NoDiameter"];
/** @type {Record<string, string[]>} by request, what ends the waiting for it */
const CONTRARY = {
  Enable: ["Disable"],
  Disable: ["Enable"],
  Hold: ["Resume", "Disable"],
  Resume: ["Hold", "Disable"],
  Trim: ["Trim"],
  Diameter: DIAMETERS,
  NoDiameter: DIAMETERS,
  ChooseModel: ["ChooseModel"],
};

/**
 * Judge what was asked by a status.
 * @param {Course[]} courses the newest first; what is found is written into them
 * @param {Status} status
 * @param {number} nowMs
 */
export function watch(courses, status, nowMs) {
  courses.forEach((course, k) => {
    const unseen = course.blind;
    course.blind = false;
    if (!WATCHED.includes(course.answer) || course.came !== null || course.ended) return;
    course.started ||= startOf(status); // asked without data: of the loop that is seen first
    const later = courses.slice(0, k).filter((one) => isContrary(one, course));
    course.ended = endOf(course, later, status, nowMs - (course.answered ?? nowMs), unseen);
    const undecided = later.some((one) => one.answer === "waits");
    if (course.ended || undecided || status.number <= course.number) return;
    if (acts(status, course)) course.came = nowMs;
    course.stage = stageOf(status, course);
  });
}

/** @param {Status} status @returns {string} */
function startOf(status) {
  return status.started ?? "";
}

/**
 * @param {Course} course
 * @param {Course[]} later requests of the contrary since then
 * @param {Status} status
 * @param {number} passedMs
 * @param {boolean} unseen whether there were no data until now
 * @returns {string}
 */
function endOf(course, later, status, passedMs, unseen) {
  if (startOf(status) !== course.started) return "restarted";
  if (later.some((one) => WATCHED.includes(one.answer))) return "replaced";
  if (passedMs <= LATE_MS) return "";
  return unseen ? "unseen" : "late";
}

/** @param {Course} later @param {Course} course */
function isContrary(later, course) {
  return (CONTRARY[course.method]?.includes(later.method) ?? false)
    && (course.method !== "Trim" || later.args[0] === course.args[0]);
}
