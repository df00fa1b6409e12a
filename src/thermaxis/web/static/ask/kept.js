// @ts-check
// The last requests of a person, kept in this window of the browser from page to page until
// somebody else looks, or nobody: another log-in begins with an empty list.

import { ENDS } from "./watch.js";

/** @typedef {import("./ask.js").RequestState} RequestState */

const KEPT = "thermaxis.requests.3"; // with another form of a request another number
const ANSWERS = ["waits", "accepted", "refused", "unknown"];
const TEXTS = ["method", "title", "reason", "started", "model", "person", "stage"];

/** Who has logged in when: people may share a name, but not the token of a log-in, which is kept
 * as a number that it cannot be made of again. */
function logIn() {
  const { name = "", token = "" } = document.body.dataset;
  let hash = 0x811c9dc5; // FNV-1a
  for (const letter of token) {
    hash = Math.imul(hash ^ (letter.codePointAt(0) ?? 0), 0x01000193) >>> 0;
  }
  return name ? `${hash} ${name}` : "";
}

let loggedOut = false;

/** @param {RequestState[]} requests */
export function keep(requests) {
  if (!logIn() || loggedOut) return;
  try {
    sessionStorage.setItem(KEPT, JSON.stringify({ logIn: logIn(), requests }));
  } catch {
    // a browser that keeps nothing shows what this page has asked
  }
}

/** What was asked from another page since this log-in. @returns {RequestState[]} */
export function kept() {
  try {
    const found = JSON.parse(sessionStorage.getItem(KEPT) ?? "{}");
    if (logIn() && found.logIn === logIn() && Array.isArray(found.requests)) {
      return found.requests.filter(isRequest).map(unanswered);
    }
    forget();
  } catch {
    // nothing is kept, or nothing of ours
  }
  return [];
}

/** Whoever comes after a log-out begins with an empty list: what this page still hears of its
 * requests before it is gone is not kept. */
export function endKeeping() {
  loggedOut = true;
  forget();
}

function forget() {
  try {
    sessionStorage.removeItem(KEPT);
  } catch {
    // a browser that keeps nothing has nothing to forget
  }
}

/** @param {any} one */
function isRequest(one) {
  return one !== null && typeof one === "object"
    && TEXTS.every((name) => typeof one[name] === "string")
    && Array.isArray(one.args) && one.args.every(isArgument)
    && Number.isFinite(one.requested) && Number.isFinite(one.number)
    && isTime(one.answered) && isTime(one.came)
    && (one.sha256 === null || typeof one.sha256 === "string")
    && typeof one.blind === "boolean"
    && ANSWERS.includes(one.answer) && ENDS.includes(one.ended);
}

/** @param {unknown} one */
function isArgument(one) {
  return typeof one === "string" || Number.isFinite(one);
}

/** @param {unknown} one */
function isTime(one) {
  return one === null || Number.isFinite(one);
}

/** The page that waited for an answer is gone: it may still take effect. @param {RequestState} request
 * @returns {RequestState} */
function unanswered(request) {
  return request.answer === "waits"
    ? { ...request, answer: "unknown", answered: request.requested } : request;
}
