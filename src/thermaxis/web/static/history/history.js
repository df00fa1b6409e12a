// @ts-check
// The history: any span, its series and events, a second span over it, exports.

import { drawChart } from "../chart/chart.js";
import { button, byId, made } from "../elements.js";
import { eventMark } from "./event_marks.js";
import { showEvents } from "./events.js";
import { bySeries, labelOf } from "./series.js";
import {
  asked, clearField, fieldTime, pageOfPast, pointsFor, query, Refused, saved, setField, tellWrong,
  told,
} from "./past.js";
import { duration, moment, shortNames, word } from "../words.js";

/** @typedef {import("./past.js").Span} Span */
/** @typedef {import("./past.js").Past} Past */

const MOST_SERIES = 8;
const DAY_MS = 86_400_000;
const KEPT = "thermaxis.history";

/** @type {Record<string, string>} */
let units = {};
/** @type {string[]} */
let chosen = [];
/** @type {number | null} */
let secondFirst = null;
const chart = byId("chart");

const page = pageOfPast({
  chart,
  question: questionOf,
  recorded,
  find: (shown, signal) => {
    keep(shown);
    return Promise.all([
      linesOf(shown, signal),
      secondLines(shown, signal),
      asked(`/history/events?${query(shown, {})}`, signal),
    ]);
  },
  draw: (shown, [lines, second, happened]) => {
    draw(shown, lines, second, happened.events.map(eventMark));
  },
  tell: ([, , happened]) => showEvents(happened),
});

/** @param {Span | null} stated null: the fields state none @returns {import("./past.js").Question} */
function questionOf(stated) {
  const second = secondFirst === null ? [] : [moment(secondFirst)];
  const said = [...chosen.map(labelOf), ...second].join(", ");
  return { span: stated, of: [...[...chosen].sort(), String(secondFirst)], said: said || "–" };
}

/** @param {Span} wanted @param {AbortSignal} signal @returns {Promise<Record<string, Past>>} */
async function linesOf(wanted, signal) {
  if (!chosen.length) throw new Refused(word("history-no_series"));
  const more = { names: chosen, points: pointsFor(chart) };
  return (await asked(`/history/trend?${query(wanted, more)}`, signal)).series;
}

/** @param {Span} wanted @param {AbortSignal} signal */
async function secondLines(wanted, signal) {
  if (secondFirst === null) return {};
  const last = secondFirst + (wanted.last - wanted.first);
  return linesOf({ first: secondFirst, last }, signal);
}

/**
 * @param {Span} shown
 * @param {Record<string, Past>} lines
 * @param {Record<string, Past>} second
 * @param {import("./event_marks.js").EventMark[]} marks
 */
function draw(shown, lines, second, marks) {
  const [left, right] = unitsOf();
  const shift = secondFirst === null ? 0 : shown.first - secondFirst;
  drawChart(chart, {
    lines: [
      ...Object.entries(lines).map(([name, line], k) => lineOf(name, line, k, 0, left)),
      ...Object.entries(second).map(([name, line], k) => lineOf(name, line, k, shift, left)),
    ],
    marks,
    marksListed: 10,
    time: true,
    first: shown.first,
    last: shown.last,
    yTitle: left,
    rightTitle: right ?? "",
    label: word("history-series"),
    onSpan: page.pointedAt,
  });
  tell(shown, lines, second);
}

/**
 * @param {string} name
 * @param {Past} line
 * @param {number} k
 * @param {number} shift of a second span [ms]; 0: the first one
 * @param {string} left unit of the left axis
 * @returns {import("../chart/chart.js").Line}
 */
function lineOf(name, line, k, shift, left) {
  return {
    name: labelOf(name),
    unit: line.unit,
    x: shift ? line.t.map((at) => at + shift) : line.t,
    y: line.mean,
    low: shift ? undefined : line.lowest,
    high: shift ? undefined : line.highest,
    axis: line.unit === left ? "left" : "right",
    color: (k % 6) + 1,
    dash: shift ? "dash" : "solid",
    marker: shift ? "none" : undefined,
    unlisted: shift !== 0,
    digits: line.unit === "µm" || line.unit === "°C" ? 1 : 3,
  };
}

/**
 * @param {Span} shown
 * @param {Record<string, Past>} lines
 * @param {Record<string, Past>} second
 */
function tell(shown, lines, second) {
  const stepS = Math.max(0, ...Object.values(lines).map((line) => line.step_s));
  const length = duration((shown.last - shown.first) / 1000);
  const values = { first: moment(shown.first), last: moment(shown.last), length };
  byId("told").textContent = stepS < 0.05
    ? word("history-told_cycles", values)
    : word("history-told", { ...values, step: duration(stepS) });
  tellSecond(shown, second);
}

/** @param {Span} shown @param {Record<string, Past>} second */
function tellSecond(shown, second) {
  const place = byId("second-told");
  byId("second-off").setAttribute("aria-pressed", String(secondFirst === null));
  place.textContent = "";
  if (secondFirst === null) return;
  const shift = shown.first - secondFirst;
  const values = { first: moment(secondFirst), length: duration(Math.abs(shift) / 1000) };
  const empty = !Object.values(second).some((line) => line.mean.some((y) => y !== null));
  if (empty) {
    const last = moment(secondFirst + (shown.last - shown.first));
    place.textContent = word("history-second_empty", { first: values.first, last });
    return;
  }
  place.textContent = shift > 0
    ? word("history-second_told_later", values)
    : word("history-second_told_earlier", values);
}

function unitsOf() {
  return [...new Set(chosen.map((name) => units[name] ?? ""))];
}

// ---- choice of series ----------------------------------------------------------------------

function listSeries() {
  const place = byId("series");
  place.replaceChildren();
  for (const [group, names] of bySeries(units)) {
    place.append(made("h3", shortNames(group)), ...names.map(seriesButton));
  }
}

/** @param {string} name */
function seriesButton(name) {
  const unit = units[name] ? ` [${units[name]}]` : "";
  const one = button(labelOf(name) + unit, () => choose(name, one));
  one.setAttribute("aria-pressed", String(chosen.includes(name)));
  return one;
}

/** @param {string} name @param {HTMLElement} pressed */
function choose(name, pressed) {
  const wanted = chosen.includes(name) ? chosen.filter((one) => one !== name) : [...chosen, name];
  if (wanted.length > MOST_SERIES) {
    tellWrong(word("history-too_many", { most: MOST_SERIES }));
    return;
  }
  if (new Set(wanted.map((one) => units[one] ?? "")).size > 2) {
    tellWrong(word("history-two_units"));
    return;
  }
  chosen = wanted;
  pressed.setAttribute("aria-pressed", String(chosen.includes(name)));
  page.showAgain();
}

/** What acts, and temperatures. @param {string[]} acting @returns {string[]} */
function firstChoice(acting) {
  const names = Object.keys(units);
  const offsets = acting.filter((name) => name in units).slice(0, 4);
  const inputs = names.filter((name) => units[name] === "°C" && !/_(used|redundant)_/.test(name));
  return [...offsets, ...inputs].slice(0, 5);
}

// ---- begin ---------------------------------------------------------------------------------

/** @param {AbortSignal} [signal] */
async function recorded(signal) {
  const found = await asked("/history/series", signal);
  const known = Object.keys(units).join();
  units = found.series;
  chosen = chosen.filter((name) => name in units);
  if (!chosen.length) chosen = firstChoice(found.acting);
  if (Object.keys(units).join() !== known) listSeries();
  return found;
}

/** Keep what a page that loads itself again goes on with. @param {Span} span */
function keep(span) {
  try {
    sessionStorage.setItem(KEPT, JSON.stringify({ span, chosen, secondFirst }));
  } catch {
    // a browser that keeps nothing begins anew
  }
}

/** @returns {{span: Span | null, chosen: string[], secondFirst: number | null}} */
function kept() {
  const nothing = { span: null, chosen: [], secondFirst: null };
  const reloaded = performance.getEntriesByType("navigation")
    .some((entry) => /** @type {PerformanceNavigationTiming} */ (entry).type === "reload");
  try {
    const text = reloaded ? sessionStorage.getItem(KEPT) : null;
    return text ? { ...nothing, ...JSON.parse(text) } : nothing;
  } catch {
    return nothing;
  }
}

/** @param {number | null} first */
function layOver(first) {
  secondFirst = first;
  if (first !== null) setField("second-from", first);
  else clearField("second-from");
  page.showAgain();
}

function wireSecond() {
  const back = (/** @type {number} */ ms) => () => {
    const span = page.span();
    if (span) layOver(span.first - ms);
  };
  byId("second-day").addEventListener("click", back(DAY_MS));
  byId("second-week").addEventListener("click", back(7 * DAY_MS));
  byId("second-off").addEventListener("click", () => layOver(null));
  byId("second-from").addEventListener("change", () => {
    const first = fieldTime("second-from");
    if (Number.isFinite(first)) layOver(first);
  });
}

function wireExport() {
  const place = document.getElementById("export-told");
  /** @type {NodeListOf<HTMLButtonElement>} */
  const buttons = document.querySelectorAll("button[data-format]");
  const turn = (/** @type {boolean} */ off) => buttons.forEach((one) => { one.disabled = off; });
  for (const one of buttons) {
    one.addEventListener("click", async () => {
      const span = page.span();
      if (!span || !place) return;
      place.textContent = word("history-export_works");
      turn(true);
      try {
        const format = one.dataset.format ?? "";
        const name = await saved(`/history/export?${query(span, { format })}`);
        place.textContent = word("history-export_done", { name });
      } catch (error) {
        if (!(error instanceof Refused)) throw error;
        place.textContent = error.message;
      } finally {
        turn(false);
      }
    });
  }
}

async function start() {
  wireSecond();
  wireExport();
  const last = kept();
  chosen = last.chosen;
  secondFirst = last.secondFirst;
  if (secondFirst !== null) setField("second-from", secondFirst);
  if (last.span === null) {
    await page.showLength(8);
    return;
  }
  if (await told(() => recorded())) await page.show(last.span);
}

void start();
