// @ts-check
// How far the last requests of a person came: answered, and effective as soon as the loop's status
// shows that what was asked acts at the machine. What was set already when it was asked shows
// nothing without an answer. They are kept in this window of the browser from page to page.

import { made, say } from "../elements.js";
import { latest, onNoData, onStatus } from "../live.js";
import { clock, duration, exactly, pageLanguage, shortNames, signed, word } from "../words.js";

const MOST = 3;
const KEPT = "thermaxis.requests.6"; // with another form of a request another number
const LATE_MS = 15 * 60_000;
const NEAR_ZERO_UM = 0.05;
const HALF_A_STEP_UM = 0.5; // of a control that keeps its offset in whole micrometres
const SAME = 1e-6;
const MISMATCHES = ["offset_mismatch", "another_writer"];
const WATCHED = ["accepted", "unknown"];
const WRONG = ["refused", "unknown"];
const HELD = ["operator_hold", "hold_expired"];
const NOT_ACTING = ["headline-not_acting", "headline-another_writer", "headline-unreachable"];
/** What a sensor's quality is called whose value waits for a person's word. */
export const JUMPED = "too_fast";

/** @typedef {Record<string, any>} Status */
/** @typedef {{kind: "accepted" | "refused" | "unknown", reason: Record<string, string>}} Answer */

/**
 * A request and how far it came; times in milliseconds.
 * @typedef {object} Asked
 * @property {string} method
 * @property {any[]} args
 * @property {string | null} sha256 hash of a model's file
 * @property {number} requested
 * @property {"waits" | Answer["kind"]} answer
 * @property {number} answered
 * @property {Answer["reason"]} reason in words, by language
 * @property {string} started when the loop was started that was asked; empty if that is not known
 * @property {number} number the loop's number when it was asked
 * @property {boolean} stood whether it was set already when it was asked
 * @property {number | null} came when it was effective
 */

/** Words of what needs no value. @type {Record<string, string>} */
const TITLES = {
  Enable: "operator-enable", Disable: "operator-disable", Hold: "operator-hold",
  Resume: "operator-resume", Acknowledge: "operator-acknowledge", Datum: "operator-datum",
};

/** Which requests end one another. @type {Record<string, string>} */
const TOPICS = {
  Enable: "state", Disable: "state", Hold: "state", Resume: "state", NoDiameter: "Diameter",
};

/** Whether a status shows that what was asked acts.
 * @type {Record<string, (status: Status, asked: Asked) => boolean>} */
const EFFECTS = {
  Enable: acts,
  Disable: ({ state, outputs }) =>
    state === "Off" && Object.values(outputs).every((axis) => arrived(axis, 0)),
  Hold: isHeld,
  Resume: (status) => !isHeld(status),
  Acknowledge: (status) => !waitsForAPerson(status),
  Trim: (status, asked) => {
    const { args: [output, um] } = asked;
    if (!isTrimSet(status, asked)) return false;
    if (status.state !== "Active") return um === 0; // elsewhere nothing moves
    return arrived(status.outputs[output], status.outputs[output].wanted_um);
  },
  Diameter: (status, { args: [mm] }) => status.diameter_mm === mm,
  NoDiameter: (status) => status.diameter_mm === null,
  Touch: ({ outputs }, { args: [output, um] }) => Math.abs((outputs[output]?.touch_um ?? NaN) - um) <= SAME,
  Datum: ({ outputs }) =>
    Object.values(outputs).every((axis) => (axis.offset_known_um ?? null) === null),
  // It acts once the compensation follows it: until it has settled nothing moves.
  ChooseModel: (status, asked) => acts(status) && isLoaded(status, asked)
    && !status.reasons.includes("settling"),
};

/** Whether a status shows that what was asked is set, where it acts later only.
 * @type {typeof EFFECTS} */
const SET = { Trim: isTrimSet, ChooseModel: isLoaded };

/** @type {Asked[]} the newest first */
let requests = kept();
const aloud = made("p", "", "unseen");
aloud.setAttribute("aria-live", "polite");
document.body.append(aloud);
keep(requests);
tell();
onStatus((status) => { watch(requests, status, Date.now()); tell(); });
onNoData(tell);

/** Alarms of offsets that were not where the compensation had left them. @param {Status} status */
export function foundElsewhere(status) {
  return status.alarms.filter((/** @type {any} */ one) => MISMATCHES.includes(one.code));
}

/** @param {Status} status */
export function isHeld(status) {
  return status.reasons.some((/** @type {string} */ one) => HELD.includes(one));
}

/** Whether something waits to be acknowledged. @param {Status} status */
export function waitsForAPerson(status) {
  return status.state === "Fault" || foundElsewhere(status).length > 0
    || Object.values(status.outputs).some((axis) => axis.offset_void)
    || Object.values(status.inputs).some((input) => input.quality === JUMPED);
}

/** @param {number | null | undefined} um */
export function isZero(um) {
  return Math.abs(um ?? 0) < NEAR_ZERO_UM;
}

/** @param {Status} status @param {Asked} asked */
function isLoaded(status, { args: [file], sha256 }) {
  return status.model_file === file && (!sha256 || status.model_sha256 === sha256);
}

/** @param {Status} status @param {Asked} asked */
function isTrimSet({ outputs }, { args: [output, um] }) {
  const axis = outputs[output];
  return axis !== undefined && Math.abs(axis.trim_um - um) <= SAME
    && (um === 0 || axis.trim_owner === document.body.dataset.name);
}

/** Whether it compensates, and nothing is known against the control's following it.
 * @param {Status} status */
function acts({ state, sink_reason, headline }) {
  return state === "Active" && !sink_reason && !NOT_ACTING.includes(headline.code);
}

/** Whether a correction, and what acts of it, is at a value. @param {any} axis @param {number} um */
function arrived(axis, um) {
  const deadband = axis.limits?.deadband_um ?? 0;
  return axis.acting_known && Math.abs((axis.correction_um ?? 0) - um) <= deadband + NEAR_ZERO_UM
    && Math.abs(axis.acting_um - um) <= Math.max(deadband, HALF_A_STEP_UM) + NEAR_ZERO_UM;
}

/**
 * Note which requests a status shows to be in effect.
 * @param {Asked[]} all the newest first
 * @param {Status} status
 * @param {number} nowMs
 */
export function watch(all, status, nowMs) {
  for (const one of all) {
    one.started ||= status.started; // asked without data: of the loop that is seen first
    if (!WATCHED.includes(one.answer) || one.came !== null || status.number <= one.number) continue;
    if (!endOf(all, one, status, nowMs) && EFFECTS[one.method]?.(status, one)) one.came = nowMs;
  }
}

/**
 * Why a status cannot show any more that it is this request which has taken effect; empty if it can.
 * @param {Asked[]} all @param {Asked} asked @param {Status | null} status @param {number} nowMs
 */
export function endOf(all, asked, status, nowMs) {
  const later = all.slice(0, all.indexOf(asked));
  if (later.some((one) => one.answer !== "refused" && topicOf(one) === topicOf(asked))) {
    return word("operator-effect_replaced");
  }
  if (!status || (asked.stood && asked.answer === "unknown")) {
    return word("operator-effective_unknown");
  }
  if (status.started !== asked.started) return word("operator-effect_restarted");
  return nowMs - asked.answered <= LATE_MS ? ""
    : word("operator-effective_late", { time: duration(LATE_MS / 1000) });
}

/** @param {number | null | undefined} mm */
export function diameterWord(mm) {
  return (mm ?? null) === null ? word("operator-tool_centre") : `${exactly(mm)}\u00a0mm`;
}

/** What is asked, as its button says it. @param {Pick<Asked, "method" | "args">} asked */
export function titleOf(asked) {
  const { method, args: [first, value] } = asked;
  if (method === "ChooseModel") return `${word("common-page_model")} ${first}`;
  if (method === "Trim" || method === "Touch") {
    const key = method === "Trim" ? "operator-trim_ask" : "operator-touch_ask";
    return `${word(key)} ${shortNames(first)} ${signed(value, 1)}\u00a0µm`;
  }
  return topicOf(asked) === "Diameter"
    ? word("operator-diameter_is", { diameter: diameterWord(first) }) : word(TITLES[method] ?? "");
}

/** @param {Pick<Asked, "method" | "args">} asked */
function topicOf({ method, args }) {
  return method === "Trim" ? `Trim ${args[0]}` : TOPICS[method] ?? method;
}

// ---- what is asked now -----------------------------------------------------------------------

/** @param {string} method @param {(string | number)[]} args @param {string | null} sha256
 * @param {Status | null} status as it is now; null: no data
 * @returns {Asked} */
export function begin(method, args, sha256, status = latest()) {
  const { started = "", number = -1 } = status ?? {};
  /** @type {Asked} */
  const asked = {
    method, args, sha256, started, number, requested: Date.now(), answer: "waits",
    answered: Date.now(), reason: {}, stood: false, came: null,
  };
  asked.stood = status !== null && !!(SET[method] ?? EFFECTS[method])?.(status, asked);
  requests = [asked, ...requests].slice(0, MOST);
  tell();
  return asked;
}

/** @param {Asked} asked @param {Answer} answer */
export function take(asked, { kind, reason }) {
  Object.assign(asked, { answer: kind, reason, answered: Date.now() });
  const status = latest();
  if (status) watch(requests, status, Date.now());
  tell();
}

// ---- the lines that show how far it came -----------------------------------------------------

function tell() {
  const [newest, ...older] = requests;
  if (!newest) return;
  const place = document.querySelector("[data-requests]") ?? ownPlace();
  const lines = [made("b", titleOf(newest)), ...linesOf(newest), ...older.map(shortOf)];
  const text = lines.map((line) => line.textContent);
  place.setAttribute("data-answer", newest.answer);
  if (place.textContent === text.join("")) return;
  place.replaceChildren(...lines);
  keep(requests);
  // What another page has asked was read aloud there.
  if (newest.requested < performance.timeOrigin) return;
  say(aloud, text.slice(0, text.length - older.length).join(" "));
}

/** @param {Asked} asked */
function linesOf(asked) {
  const [watched, reason] = [WATCHED.includes(asked.answer), asked.reason[pageLanguage]];
  return [
    made("span", word("operator-requested_at", { time: clock(asked.requested) })),
    made("span", `→ ${answerOf(asked)}`, WRONG.includes(asked.answer) ? "ask-wrong" : ""),
    ...(watched ? [made("span", `→ ${effectOf(asked)}`, "ask-stands")] : []),
    ...(reason ? [made("span", reason)] : []),
  ];
}

/** A request before the newest one: what was asked when, and how it stands. @param {Asked} asked */
function shortOf(asked) {
  const { answer, came, reason } = asked;
  const effect = WATCHED.includes(answer) ? effectOf(asked) : reason[pageLanguage] ?? "";
  const stands = answer === "accepted" || came ? effect : `${answerOf(asked)} ${effect}`;
  return made("span", `${clock(asked.requested)} ${titleOf(asked)}: ${stands}`, "ask-older");
}

/** @param {Asked} asked */
function answerOf({ answer, answered }) {
  const time = clock(answered);
  return {
    waits: () => word("operator-answer_waits"),
    refused: () => `✕ ${word("operator-refused_at", { time })}`,
    unknown: () => `? ${word("operator-answer_none")}`,
    accepted: () => word("operator-accepted_at", { time }),
  }[answer]();
}

/** @param {Asked} asked */
function effectOf(asked) {
  if (asked.came !== null) {
    const time = clock(asked.came);
    return asked.answer === "unknown" ? word("operator-as_asked_at", { time })
      : `✓ ${word("operator-effective_at", { time })}`;
  }
  const status = latest();
  const ended = endOf(requests, asked, status, Date.now());
  if (ended) return ended;
  if (asked.method !== "ChooseModel" || !status || !isLoaded(status, asked)) {
    return word("operator-effective_waits");
  }
  return word(status.reasons.includes("settling") ? "ask-model_settles" : "ask-model_waits");
}

function ownPlace() {
  const place = made("div", "", "ask-place");
  place.setAttribute("data-requests", "");
  document.querySelector("main")?.after(place);
  return place;
}

// ---- from page to page -----------------------------------------------------------------------

/** Who has logged in when: the begin of a token tells log-ins under the same name apart. */
function logIn() {
  const { name = "", token = "" } = document.body.dataset;
  return `${name} ${token.slice(0, 8)}`;
}

/** @param {Asked[]} all */
export function keep(all) {
  try {
    sessionStorage.setItem(KEPT, JSON.stringify({ logIn: logIn(), requests: all }));
  } catch {
    // a browser that keeps nothing shows what this page has asked
  }
}

/** What was asked from another page since this log-in; a page that waited for an answer and is gone
 * will not have it. @returns {Asked[]} */
export function kept() {
  try {
    const found = JSON.parse(sessionStorage.getItem(KEPT) ?? "{}");
    if (found.logIn !== logIn()) return [];
    return found.requests.map((/** @type {Asked} */ one) =>
      (one.answer === "waits" ? { ...one, answer: "unknown" } : one));
  } catch {
    return [];
  }
}
