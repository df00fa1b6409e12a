// @ts-check
// The last eight hours, or as much of them as there is: what acted, key temperatures, what happened.

import { drawChart } from "../chart/chart.js";
import { byId, say } from "../elements.js";
import { eventMark } from "../history/event_marks.js";
import { shortNames, word } from "../words.js";

/** @typedef {import("../chart/chart.js").Line} Line */
/** @typedef {{unit: string, t: number[], mean: (number | null)[]}} Series */

const REFRESH_MS = 15_000;
const MOST_LINES = 6;
const LEAST_UM = 10; // noise stays small
const MICROMETRES = "µm";
const STD = "_offset_std_um";

/** Read the trend, again and again. */
export async function startTrend() {
  setTimeout(startTrend, REFRESH_MS);
  let error = word("operator-trend_fails");
  try {
    const answer = await fetch("/trend8", { cache: "no-store" });
    const found = await answer.json();
    if (answer.ok) error = found.error ?? draw(found);
  } catch (failure) {
    if (!(failure instanceof TypeError) && !(failure instanceof SyntaxError)) throw failure;
  }
  say(byId("trend-told"), error);
}

/** Draw, and return what is told below.
 * @param {{first: number, last: number, series: Record<string, Series>, events: any[]}} found */
function draw({ first, last, series, events }) {
  /** @type {Line[]} */
  const all = Object.entries(series).filter(([name]) => !name.endsWith(STD)).map(([name, { unit, t, mean }]) => ({
    ...named(name, mean, series),
    unit,
    x: t,
    y: mean,
    axis: unit === MICROMETRES ? "left" : "right",
  }));
  const lines = chosen(all);
  drawChart(byId("trend"), {
    still: true,
    time: true,
    first,
    last,
    leastSpan: LEAST_UM,
    label: word("operator-trend_label"),
    yTitle: MICROMETRES,
    rightTitle: "°C",
    lines,
    marks: events.map(eventMark),
  });
  const count = all.length - lines.length;
  return count ? word("operator-trend_more", { count }) : "";
}

/** Name of a line; what touches add has the band of its standard uncertainty.
 * @param {string} name @param {(number | null)[]} mean @param {Record<string, Series>} series */
function named(name, mean, series) {
  const stem = name.replace(/_(effective|accepted|offset)(_um)?$/, "");
  if (!name.endsWith("_offset_um")) return { name: shortNames(stem) };
  const std = series[`${stem}${STD}`]?.mean ?? [];
  const edge = (/** @type {number} */ side) => mean.map((um, k) => {
    const own = std[k] ?? null;
    return um === null || own === null ? null : um + side * own;
  });
  return { name: word("operator-trend_touches", { axis: shortNames(stem) }), low: edge(-1), high: edge(1) };
}

/** Every offset, and of the temperatures those that moved most. @param {Line[]} all */
function chosen(all) {
  const left = all.filter((line) => line.axis === "left").slice(0, MOST_LINES - 1);
  const right = all.filter((line) => line.axis === "right");
  const most = [...right].sort((a, b) => moved(b) - moved(a)).slice(0, MOST_LINES - left.length);
  return [...left, ...right.filter((line) => most.includes(line))];
}

/** @param {Line} line */
function moved(line) {
  const there = /** @type {number[]} */ (line.y.filter((y) => y !== null));
  return there.length ? Math.max(...there) - Math.min(...there) : -1;
}
