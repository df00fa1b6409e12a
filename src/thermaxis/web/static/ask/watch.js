// @ts-check
// How far each request came, by every status that the loop tells, until it is in effect or nobody
// can say any more that it is this request which the status shows.

import { acts, stageOf } from "./effects.js";

/** @typedef {import("./ask.js").RequestState} RequestState */
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
 * @param {RequestState[]} requests the newest first; what is found is written into them
 * @param {Status} status
 * @param {number} nowMs
 */
export function watch(requests, status, nowMs) {
  requests.forEach((request, k) => {
    const unseen = request.blind;
    request.blind = false;
    if (!WATCHED.includes(request.answer) || request.came !== null || request.ended) return;
    request.started ||= startOf(status); // asked without data: of the loop that is seen first
    const later = requests.slice(0, k).filter((one) => isContrary(one, request));
    request.ended = endOf(request, later, status, nowMs - (request.answered ?? nowMs), unseen);
    const undecided = later.some((one) => one.answer === "waits");
    if (request.ended || undecided || status.number <= request.number) return;
    if (acts(status, request)) request.came = nowMs;
    request.stage = stageOf(status, request);
  });
}

/** @param {Status} status @returns {string} */
function startOf(status) {
  return status.started ?? "";
}

/**
 * @param {RequestState} request
 * @param {RequestState[]} later requests of the contrary since then
 * @param {Status} status
 * @param {number} passedMs
 * @param {boolean} unseen whether there were no data until now
 * @returns {string}
 */
function endOf(request, later, status, passedMs, unseen) {
  if (startOf(status) !== request.started) return "restarted";
  if (later.some((one) => WATCHED.includes(one.answer))) return "replaced";
  if (passedMs <= LATE_MS) return "";
  return unseen ? "unseen" : "late";
}

/** @param {RequestState} later @param {RequestState} request */
function isContrary(later, request) {
  return (CONTRARY[request.method]?.includes(later.method) ?? false)
    && (request.method !== "Trim" || later.args[0] === request.args[0]);
}
