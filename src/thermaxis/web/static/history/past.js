// @ts-check
// What history and probe share: spans, local times in fields, and what stays after a refusal.

import { asked, Refused } from "../asked.js";
import { byId, say } from "../elements.js";
import { moment, word } from "../words.js";

/** @typedef {{first: number, last: number}} Span */
/** @typedef {{first: number | null, last: number | null}} Recorded */
/**
 * @typedef {object} Past
 * @property {string} unit
 * @property {number} step_s
 * @property {number[]} t
 * @property {(number | null)[]} mean
 * @property {(number | null)[]} lowest
 * @property {(number | null)[]} highest
 */

const HOUR_MS = 3_600_000;

/** @type {Span | null} what chart, numbers and events are of */
let drawn = null;
let asking = new AbortController();

/**
 * Ask for values of a span.
 * @param {string} path
 * @param {Span} span
 * @param {Record<string, string | string[]>} more
 * @param {AbortSignal} signal
 */
export function askedOf(path, span, more, signal) {
  return asked(`${path}?${query(span, more)}`, { signal });
}

/** @param {Span} span @param {Record<string, string | string[]>} more */
export function query({ first, last }, more) {
  const found = new URLSearchParams();
  const all = { first: new Date(first).toISOString(), last: new Date(last).toISOString(), ...more };
  for (const [name, values] of Object.entries(all)) {
    for (const value of [values].flat()) found.append(name, value);
  }
  return found.toString();
}

/** @param {string} id of a field of local time @returns {number} NaN where there is none [ms] */
function fieldTime(id) {
  return Date.parse(/** @type {HTMLInputElement} */ (byId(id)).value);
}

/**
 * Show which span is asked for, and return it as the fields show it: in whole seconds.
 * @param {Span} wanted
 * @param {number | null} hours which length it is; null: none of them
 * @returns {Span}
 */
function stateSpan(wanted, hours) {
  for (const one of byId("lengths").querySelectorAll("button")) {
    one.setAttribute("aria-pressed", String(Number(one.dataset.hours) === hours));
  }
  const ends = [Math.floor(wanted.first / 1000), Math.ceil(wanted.last / 1000)];
  const [first, last] = ends.map((second, k) => {
    const local = 1000 * second - 60_000 * new Date(1000 * second).getTimezoneOffset();
    const field = /** @type {HTMLInputElement} */ (byId(k ? "to" : "from"));
    field.value = new Date(local).toISOString().slice(0, 19);
    return 1000 * second;
  });
  sayFields();
  return { first, last };
}

/** A field has the form of the browser's language; beside it stands that of the page's. */
function sayFields() {
  for (const id of ["from", "to"]) byId(`${id}-said`).textContent = moment(fieldTime(id));
}

/** @param {string} text an empty one takes it away */
export function tellWrong(text) {
  const place = byId("wrong");
  say(place, text);
  place.hidden = text === "";
}

/**
 * Say that nothing came; what is shown stays, marked as that of before.
 * @param {unknown} error anything else than a refusal is a fault of the page, and no word for people
 */
export function refused(error) {
  if (!(error instanceof Refused)) throw error;
  const [first, last] = [moment(drawn?.first), moment(drawn?.last)];
  tellWrong(error.message + (drawn ? ` ${word("history-former", { first, last })}` : ""));
  byId("content").dataset.former = drawn ? "yes" : "no";
  byId("told").textContent = "";
}

/** What was asked for is shown now. @param {Span} span */
export function shows(span) {
  drawn = span;
  tellWrong("");
  byId("content").dataset.former = "no";
}

/**
 * What a question brings, which ends the one before; null where it brings nothing.
 * @template T
 * @param {(signal: AbortSignal) => Promise<T>} ask
 * @returns {Promise<T | null>}
 */
async function answerTo(ask) {
  asking.abort();
  asking = new AbortController();
  const { signal } = asking;
  byId("told").textContent = word("history-loading");
  try {
    const found = await ask(signal);
    return signal.aborted ? null : found;
  } catch (error) {
    if (!signal.aborted) refused(error);
    return null;
  }
}

/** Points that a chart has room for. @param {HTMLElement} chart */
export function pointsFor(chart) {
  return String(Math.min(2000, Math.max(300, Math.round(chart.clientWidth))));
}

/**
 * A page of past hours: it shows a span that is stated, chosen as a length, or pointed at.
 * @template T
 * @param {object} page
 * @param {HTMLElement} page.chart
 * @param {(signal: AbortSignal) => Promise<Recorded>} page.recorded
 * @param {(shown: Span, signal: AbortSignal) => Promise<T>} page.find
 * @param {(shown: Span, found: T) => void} page.draw the chart
 * @param {(shown: Span, found: T) => void} page.tell what stands beside it: a fault there takes no
 *   chart
 */
export function pageOfPast({ chart, recorded, find, draw, tell }) {
  /** @type {Span | null} */
  let span = null;
  /** @type {Span | null} what was shown before somebody pointed at a part of it */
  let before = null;

  /** @param {Span} wanted @param {number | null} hours */
  async function show(wanted, hours = null) {
    const shown = span = stateSpan(wanted, hours);
    const found = await answerTo((signal) => find(shown, signal));
    if (found === null) return;
    draw(shown, found);
    shows(shown);
    chart.dataset.drawn = String(Number(chart.dataset.drawn ?? "0") + 1);
    tell(shown, found);
  }

  /** Show a length at the end of what is recorded. @param {number} hours 0: everything */
  async function showLength(hours) {
    const found = await answerTo(recorded);
    if (found === null) return;
    before = null;
    if (found.first === null || found.last === null) {
      refused(new Refused(word("history-nothing_recorded")));
      return;
    }
    const last = 1000 * Math.ceil((found.last + 1) / 1000);
    await show({ first: hours ? last - hours * HOUR_MS : found.first, last }, hours);
  }

  /** Go into a part of what is shown, and with null back. @param {Span | null} wanted */
  function pointedAt(wanted) {
    before ??= drawn ?? span;
    if (before) void show(wanted ?? before);
    if (wanted === null) before = null;
  }

  byId("lengths").addEventListener("click", (event) => {
    const one = /** @type {HTMLElement} */ (event.target).closest("button");
    if (one) void showLength(Number(one.dataset.hours));
  });
  byId("span").addEventListener("input", sayFields);
  byId("span").addEventListener("submit", (event) => {
    event.preventDefault();
    const stated = { first: fieldTime("from"), last: fieldTime("to") };
    if (stated.last > stated.first) {
      before = null;
      void show(stated);
    } else {
      refused(new Refused(word("history-no_span")));
    }
  });
  return {
    span: () => span,
    begin: async (/** @type {Span} */ wanted) => {
      if (await answerTo(recorded)) await show(wanted);
    },
    showLength,
    showAgain: () => { if (span) void show(span); },
    pointedAt,
  };
}
