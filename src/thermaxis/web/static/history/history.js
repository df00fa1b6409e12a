// @ts-check
// The history: any span, its series and events, the same hours of a day before, exports.

import { asked, Refused } from "../asked.js";
import { drawChart } from "../chart/chart.js";
import { button, byId, made } from "../elements.js";
import { eventMark } from "./event_marks.js";
import { showEvents } from "./events.js";
import { bySeries, labelOf } from "./series.js";
import { askedOf, pageOfPast, pointsFor, query, tellWrong } from "./past.js";
import { duration, moment, shortNames, word } from "../words.js";

/** @typedef {import("./past.js").Span} Span */
/** @typedef {import("./past.js").Past} Past */
/** @typedef {Record<string, Past>} Lines */

const MOST_SERIES = 8;
const DAY_MS = 86_400_000;

/** @type {Record<string, string>} */
let units = {};
const stated = new URLSearchParams(location.search);
let chosen = stated.getAll("names");
const chart = byId("chart");
const days = /** @type {HTMLInputElement} */ (byId("days"));
days.value = stated.get("days") ?? "";

const page = pageOfPast({
  chart,
  recorded: async (signal) => {
    const found = await asked("/history/series", { signal });
    listSeries(found);
    return found;
  },
  find: (shown, signal) => {
    const more = { names: chosen, ...(days.value && { days: days.value }) };
    history.replaceState(null, "", `?${query(shown, more)}`); // also for a page that loads again
    const { first, last } = before(shown);
    return Promise.all([
      linesOf(shown, signal),
      first < shown.first ? linesOf({ first, last }, signal) : {},
      askedOf("/history/events", shown, {}, signal),
    ]);
  },
  draw: (shown, [lines, earlier, { events }]) => draw(shown, lines, earlier, events.map(eventMark)),
  tell: (shown, [lines, earlier, happened]) => {
    tell(shown, lines, earlier);
    showEvents(happened);
  },
});

/** The same hours so many days before, at most as many as a span has. @param {Span} span @returns {Span} */
function before({ first, last }) {
  const ms = Math.min(Math.max(0, days.valueAsNumber || 0), Number(days.max)) * DAY_MS;
  return { first: first - ms, last: last - ms };
}

/** @param {Span} span @param {AbortSignal} signal @returns {Promise<Lines>} */
async function linesOf(span, signal) {
  if (!chosen.length) throw new Refused(word("history-no_series"));
  const more = { names: chosen, points: pointsFor(chart) };
  return (await askedOf("/history/trend", span, more, signal)).series;
}

/**
 * @param {Span} shown
 * @param {Lines} lines
 * @param {Lines} earlier
 * @param {import("./event_marks.js").EventMark[]} marks
 */
function draw(shown, lines, earlier, marks) {
  const [left, right = ""] = unitsOf(chosen);
  const look = (/** @type {[string, Past]} */ [name, { unit, t, mean, lowest, highest }]) => ({
    name: labelOf(name),
    unit,
    x: t,
    y: mean,
    low: lowest,
    high: highest,
    axis: /** @type {"left" | "right"} */ (unit === left ? "left" : "right"),
    color: (chosen.indexOf(name) % 6) + 1,
    dash: "solid",
    digits: unit === "µm" || unit === "°C" ? 1 : 3,
  });
  const shift = shown.first - before(shown).first;
  const pale = { low: undefined, high: undefined, dash: "dash", marker: "none", unlisted: true };
  drawChart(chart, {
    lines: [
      ...Object.entries(lines).map(look),
      ...Object.entries(earlier).map(look).map((line) => (
        { ...line, ...pale, x: line.x.map((at) => at + shift) })),
    ],
    marks,
    marksListed: 10,
    time: true,
    first: shown.first,
    last: shown.last,
    yTitle: left,
    rightTitle: right,
    label: word("history-series"),
    onSpan: page.pointedAt,
  });
}

/** @param {Span} shown @param {Lines} lines @param {Lines} earlier */
function tell(shown, lines, earlier) {
  const stepS = Math.max(0, ...Object.values(lines).map((line) => line.step_s));
  const span = ({ first, last } = shown) => ({ first: moment(first), last: moment(last) });
  const values = { ...span(), length: duration((shown.last - shown.first) / 1000) };
  byId("told").textContent = stepS < 0.05
    ? word("history-told_cycles", values)
    : word("history-told", { ...values, step: duration(stepS) });
  const some = Object.values(earlier).some(({ mean }) => mean.some((y) => y !== null));
  const key = some ? "history-second_told" : "history-second_empty";
  const asks = before(shown).first < shown.first;
  byId("second-told").textContent = asks ? word(key, span(before(shown))) : "";
}

/** @param {string[]} names */
function unitsOf(names) {
  return [...new Set(names.map((name) => units[name] ?? ""))];
}

// ---- choice of series ----------------------------------------------------------------------

/** @param {{series: Record<string, string>, acting: string[]}} found */
function listSeries({ series, acting }) {
  const known = Object.keys(units).join();
  units = series;
  const names = Object.keys(units);
  chosen = chosen.filter((name) => names.includes(name));
  if (!chosen.length) { // what acts, and temperatures
    const offsets = acting.filter((name) => names.includes(name)).slice(0, 4);
    const inputs = names.filter((name) => units[name] === "°C" && !/_(used|redundant)_/.test(name));
    chosen = [...offsets, ...inputs].slice(0, 5);
  }
  if (names.join() === known) return;
  byId("series").replaceChildren(...bySeries(units).flatMap(([group, some]) =>
    [made("h3", shortNames(group)), ...some.map(seriesButton)]));
}

/** @param {string} name */
function seriesButton(name) {
  const one = button(labelOf(name) + (units[name] ? ` [${units[name]}]` : ""), () => {
    const on = chosen.includes(name);
    const wanted = on ? chosen.filter((other) => other !== name) : [...chosen, name];
    if (wanted.length > MOST_SERIES) {
      tellWrong(word("history-too_many", { most: MOST_SERIES }));
    } else if (unitsOf(wanted).length > 2) {
      tellWrong(word("history-two_units"));
    } else {
      chosen = wanted;
      one.setAttribute("aria-pressed", String(!on));
      page.showAgain();
    }
  });
  one.setAttribute("aria-pressed", String(chosen.includes(name)));
  return one;
}

// ---- export --------------------------------------------------------------------------------

/** @type {NodeListOf<HTMLButtonElement>} */
const exports = document.querySelectorAll("button[data-format]");

/** Save the span as a file that the server makes. @param {string} format */
async function save(format) {
  const span = page.span();
  if (!span) return;
  const place = byId("export-told");
  const headers = { "X-Thermaxis-Token": document.body.dataset.token ?? "" };
  place.textContent = word("history-export_works");
  exports.forEach((one) => { one.disabled = true; });
  try {
    const link = document.createElement("a");
    const path = `/history/export?${query(span, { format })}`;
    link.href = URL.createObjectURL(await asked(path, { method: "POST", headers }, (answer) => {
      const named = answer.headers.get("content-disposition") ?? "";
      link.download = /filename="([^"]+)"/.exec(named)?.[1] ?? "";
      return answer.blob();
    }));
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
    place.textContent = word("history-export_done", { name: link.download });
  } catch (error) {
    if (!(error instanceof Refused)) throw error;
    place.textContent = error.message;
  } finally {
    exports.forEach((one) => { one.disabled = false; });
  }
}

exports.forEach((one) => one.addEventListener("click", () => void save(one.dataset.format ?? "")));
days.addEventListener("change", page.showAgain);
const [first, last] = ["first", "last"].map((name) => Date.parse(stated.get(name) ?? ""));
void (last > first ? page.begin({ first, last }) : page.showLength(8));
