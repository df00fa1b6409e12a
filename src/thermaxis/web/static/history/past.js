// @ts-check
// What history and probe share: asking the server, spans, local times in fields.

import { byId, say } from "../elements.js";
import { moment, word } from "../words.js";

/** @typedef {{first: number, last: number}} Span */
/**
 * @typedef {object} Past
 * @property {string} unit
 * @property {number} step_s
 * @property {number[]} t
 * @property {(number | null)[]} mean
 * @property {(number | null)[]} lowest
 * @property {(number | null)[]} highest
 */

/**
 * What a page has asked for.
 * @typedef {object} Question
 * @property {Span | null} span null: the fields state none
 * @property {string[]} of what else was chosen, to be compared
 * @property {string} said the same in words
 */

/** What the server, or the page itself, refuses in words that are told to people. */
export class Refused extends Error {}

/** @type {Question | null} what chart, numbers and events are of */
let drawn = null;
/** @type {AbortController | null} */
let asking = null;

/** Give up what was asked before, and return the signal of the next questions. */
function newQuestion() {
  asking?.abort();
  asking = new AbortController();
  return asking.signal;
}

/**
 * Ask the server; what it refuses is thrown in words.
 * @param {string} path
 * @param {RequestInit} [how]
 */
async function answered(path, how = {}) {
  let answer;
  try {
    answer = await fetch(path, how);
  } catch (error) {
    if (how.signal?.aborted) throw error;
    throw new Refused(word("history-no_answer"));
  }
  if (answer.ok) return answer;
  const found = await answer.json().catch(() => ({}));
  throw new Refused(found.text ?? word("history-no_answer"));
}

/**
 * @param {string} path
 * @param {AbortSignal} [signal]
 * @returns {Promise<any>}
 */
export async function asked(path, signal) {
  const answer = await answered(path, { signal });
  try {
    return await answer.json();
  } catch (error) {
    if (signal?.aborted) throw error;
    throw new Refused(word("history-no_answer")); // it broke off, or is none of the screen's
  }
}

/**
 * Save a file that the server makes, and return its name.
 * @param {string} path
 */
export async function saved(path) {
  const headers = { "X-Thermaxis-Token": document.body.dataset.token ?? "" };
  const answer = await answered(path, { method: "POST", headers });
  const stated = answer.headers.get("content-disposition") ?? "";
  const link = document.createElement("a");
  link.download = /filename="([^"]+)"/.exec(stated)?.[1] ?? "";
  link.href = URL.createObjectURL(await answer.blob());
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
  return link.download;
}

/** @param {Span} span @param {Record<string, string | string[]>} more */
export function query(span, more) {
  const found = new URLSearchParams({ first: iso(span.first), last: iso(span.last) });
  for (const [name, values] of Object.entries(more)) {
    for (const value of [values].flat()) found.append(name, value);
  }
  return found.toString();
}

/** @param {number} ms */
function iso(ms) {
  return new Date(Math.round(ms)).toISOString();
}

/**
 * A time as a field of local time shows it.
 * @param {number} ms
 */
export function fieldText(ms) {
  const two = (/** @type {number} */ n) => String(n).padStart(2, "0");
  const at = new Date(ms);
  const day = `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())}`;
  return `${day}T${two(at.getHours())}:${two(at.getMinutes())}:${two(at.getSeconds())}`;
}

/**
 * The time in a field of local time; NaN where there is none.
 * @param {string} id
 */
export function fieldTime(id) {
  return Date.parse(/** @type {HTMLInputElement} */ (byId(id)).value);
}

/** @param {string} id @param {number} ms */
export function setField(id, ms) {
  /** @type {HTMLInputElement} */ (byId(id)).value = fieldText(ms);
  sayField(id);
}

/** @param {string} id */
export function clearField(id) {
  /** @type {HTMLInputElement} */ (byId(id)).value = "";
  sayField(id);
}

/** A field has the form of the browser's language; beside it stands that of the page's.
 * @param {string} id */
function sayField(id) {
  const time = fieldTime(id);
  byId(`${id}-said`).textContent = Number.isFinite(time) ? moment(time) : "";
}

/**
 * Show in the fields which span is asked for, and return it as they show it: in whole seconds.
 * @param {Span} wanted
 * @param {number | null} hours which length it is; null: none of them
 * @returns {Span}
 */
function stateSpan(wanted, hours) {
  const span = {
    first: Math.floor(wanted.first / 1000) * 1000,
    last: Math.ceil(wanted.last / 1000) * 1000,
  };
  for (const button of byId("lengths").querySelectorAll("button")) {
    button.setAttribute("aria-pressed", String(Number(button.dataset.hours) === hours));
  }
  setField("from", span.first);
  setField("to", span.last);
  return span;
}

/** @param {string} text an empty one takes it away */
export function tellWrong(text) {
  const place = byId("wrong");
  say(place, text);
  place.hidden = text === "";
}

/**
 * What a question brings; a refusal is told to people, and brings nothing.
 * @template T
 * @param {() => Promise<T>} ask
 * @param {AbortSignal} [signal] of a question that may be given up
 * @returns {Promise<T | null>}
 */
export async function told(ask, signal) {
  try {
    return await ask();
  } catch (error) {
    if (signal?.aborted) return null;
    if (!(error instanceof Refused)) throw error;
    tellWrong(error.message);
    return null;
  }
}

/** What was asked is shown now. @param {Question} question */
export function shows(question) {
  drawn = question;
  markFormer(null);
}

/**
 * What is shown stays, marked where it is not of what was asked.
 * @param {unknown} error anything else than a refusal is a fault of the page, and no word for people
 * @param {Question} question
 */
export function refused(error, question) {
  if (!(error instanceof Refused)) throw error;
  byId("told").textContent = "";
  tellWrong(error.message);
  markFormer(drawn && isSame(drawn, question) ? null : drawn, question);
}

/** @param {Question} one @param {Question} other */
function isSame(one, other) {
  return one.span?.first === other.span?.first && one.span?.last === other.span?.last
    && isSameChoice(one, other);
}

/** @param {Question} one @param {Question} other */
function isSameChoice(one, other) {
  return JSON.stringify(one.of) === JSON.stringify(other.of);
}

/**
 * Say of what is shown that it is of something else than what is stated and chosen.
 * @param {Question | null} former what is shown; null: it is of what is stated
 * @param {Question | null} [question] what is stated
 */
function markFormer(former, question = null) {
  byId("content").dataset.former = former === null ? "no" : "yes";
  const place = byId("former");
  place.hidden = former === null;
  if (former === null || former.span === null) return;
  const values = {
    first: moment(former.span.first), last: moment(former.span.last), what: former.said,
  };
  place.textContent = question === null || isSameChoice(former, question)
    ? word("history-former", values) : word("history-former_choice", values);
}

/**
 * Points that a chart has room for.
 * @param {HTMLElement} chart
 */
export function pointsFor(chart) {
  return String(Math.min(2000, Math.max(300, Math.round(chart.clientWidth))));
}

/**
 * The span of a length at the end of what is recorded.
 * @param {number} hours 0: everything
 * @param {{first: number | null, last: number | null}} recorded
 * @returns {Span | null}
 */
function spanOf(hours, recorded) {
  if (recorded.first === null || recorded.last === null) return null;
  const last = Math.ceil((recorded.last + 1) / 1000) * 1000;
  return { first: hours ? last - hours * 3_600_000 : recorded.first, last };
}

/**
 * A page of past hours: it shows a span that is stated, chosen as a length, or pointed at.
 * @template T
 * @param {object} page
 * @param {HTMLElement} page.chart
 * @param {(span: Span | null) => Question} page.question null: the fields state no span
 * @param {(signal: AbortSignal) => Promise<{first: number | null, last: number | null}>} page.recorded
 * @param {(shown: Span, signal: AbortSignal) => Promise<T>} page.find
 * @param {(shown: Span, found: T) => void} page.draw the chart
 * @param {(found: T) => void} page.tell what stands beside it: a fault there takes no chart
 */
export function pageOfPast({ chart, question, recorded, find, draw, tell }) {
  /** @type {Span | null} */
  let span = null;
  /** @type {Span | null} what was shown before somebody pointed at a part of it */
  let before = null;

  /** @param {Span} wanted @param {number | null} hours */
  async function show(wanted, hours = null) {
    const shown = stateSpan(wanted, hours);
    span = shown;
    const asks = question(shown);
    const signal = newQuestion();
    byId("told").textContent = word("history-loading");
    let found;
    try {
      found = await find(shown, signal);
    } catch (error) {
      if (!signal.aborted) refused(error, asks);
      return;
    }
    tellWrong("");
    draw(shown, found);
    chart.dataset.drawn = String(Number(chart.dataset.drawn ?? "0") + 1);
    tell(found);
    shows(asks);
  }

  /** @param {number} hours 0: everything */
  async function showLength(hours) {
    const signal = newQuestion();
    const all = await told(() => recorded(signal), signal);
    if (!all || signal.aborted) return; // another length was pressed meanwhile
    const found = spanOf(hours, all);
    before = null;
    if (found) await show(found, hours);
    else tellWrong(word("history-nothing_recorded"));
  }

  /** Go into a part of what is shown, and with null back. @param {Span | null} wanted */
  function pointedAt(wanted) {
    before ??= drawn?.span ?? span;
    if (before) void show(wanted ?? before);
    if (wanted === null) before = null;
  }

  for (const field of document.querySelectorAll("input[type=datetime-local]")) {
    field.addEventListener("input", () => sayField(field.id));
  }
  byId("lengths").addEventListener("click", (event) => {
    const button = /** @type {HTMLElement} */ (event.target).closest("button");
    if (button) void showLength(Number(button.dataset.hours));
  });
  byId("span").addEventListener("submit", (event) => {
    event.preventDefault();
    const stated = { first: fieldTime("from"), last: fieldTime("to") };
    if (stated.last > stated.first) {
      before = null;
      void show(stated);
    } else {
      refused(new Refused(word("history-no_span")), question(null));
    }
  });
  return {
    span: () => span,
    show,
    showLength,
    showAgain: () => { if (span) void show(span); },
    pointedAt,
  };
}
