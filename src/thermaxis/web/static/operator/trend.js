// @ts-check
// The last eight hours, or as much of them as there is: what acted, key temperatures, what happened.

import { drawChart } from "../chart/chart.js";
import { byId, say } from "../elements.js";
import { eventMark } from "../history/event_marks.js";
import { addPoint, joined } from "../live_points.js";
import { shortNames, word } from "../words.js";

/** @typedef {Record<string, any>} Status */
/** @typedef {{unit: string, t: number[], mean: (number | null)[]}} Series */
/** @typedef {{name: string, axis: "left" | "right", x: number[], y: (number | null)[]}} Line */

/** Column of an offset; its first group is the output without the unit. */
const OFFSET = /^(.+)_(?:effective|accepted|correction)(?:_um)?$/;

const REFRESH_MS = 30_000;
const LIVE_MS = 5_000;
const AHEAD_MS = 60_000;
const SPAN_MS = 8 * 3600 * 1000;
const MOST_LINES = 6;
const LEAST_MS = 5 * 60 * 1000; // of time the axis shows at least so much, and grows with the data
const LEAST_UM = 10;

/** @type {{series: Record<string, Series>, events: Record<string, any>[], error?: string}} */
let history = { series: {}, events: [] };
let error = "";
let asked = false;
/** @type {Map<string, import("../live_points.js").Points>} */
const live = new Map();
let liveMs = 0;
let gapMs = 3 * LIVE_MS;

export function startTrend() {
  say(byId("trend-told"), word("operator-trend_waits"));
  void refresh();
  setInterval(() => { void refresh(); }, REFRESH_MS);
}

async function refresh() {
  try {
    const answer = await fetch("/trend8", { cache: "no-store" });
    const found = await answer.json();
    error = answer.ok ? found.error ?? "" : word("operator-trend_fails");
    if (!error) history = found;
  } catch (failure) {
    if (!(failure instanceof TypeError) && !(failure instanceof SyntaxError)) throw failure;
    error = word("operator-trend_fails");
  }
  asked = true;
  draw();
}

/** Add what the loop says now behind what is stored. @param {Status} status */
export function addLive(status) {
  const now = Date.parse(status.utc);
  if (!Number.isFinite(now) || (now >= liveMs && now - liveMs < LIVE_MS)) return;
  liveMs = now;
  /** @type {Map<string, number | null>} */
  const told = new Map();
  for (const [name, axis] of Object.entries(status.outputs)) {
    told.set(columnOf(name), axis.acting_known ? axis.acting_um : null);
  }
  for (const [name, input] of Object.entries(status.inputs)) told.set(name, input.value_c);
  for (const name of [...live.keys()]) if (!told.has(name)) live.delete(name);
  for (const [name, value] of told) {
    const points = live.get(name) ?? { t: [], y: [] };
    addPoint(points, now, value, SPAN_MS);
    live.set(name, points);
  }
  gapMs = Math.max(3 * LIVE_MS, 3000 * status.cycle_s);
  if (asked) draw();
}

/** Column that the history has of what acts at an output. @param {string} output */
function columnOf(output) {
  const stem = output.replace(/_um$/, "");
  return Object.keys(history.series).find((name) => OFFSET.exec(name)?.[1] === stem)
    ?? `${stem}_effective${output.slice(stem.length)}`;
}

/** @returns {Line[]} */
function lines() {
  const stored = Object.keys(history.series);
  const names = live.size ? [...stored.filter((name) => live.has(name)), ...live.keys()] : stored;
  const until = live.size ? liveMs + AHEAD_MS : Infinity;
  return [...new Set(names)].map((name) => {
    const found = history.series[name];
    const before = { t: found?.t ?? [], y: found?.mean ?? [] };
    const seen = live.get(name) ?? { t: [], y: [] };
    const axis = OFFSET.test(name) ? "left" : "right";
    return { name, axis, ...joined(before, seen, until, gapMs) };
  });
}

/** Every correction, and of the temperatures those that moved most. @param {Line[]} all */
function chosen(all) {
  const left = all.filter((line) => line.axis === "left").slice(0, MOST_LINES - 1);
  const right = all.filter((line) => line.axis === "right");
  const most = [...right].sort((a, b) => moved(b) - moved(a)).slice(0, MOST_LINES - left.length);
  return [...left, ...right.filter((line) => most.includes(line))];
}

/** @param {Line} line */
function moved(line) {
  let [low, high] = [Infinity, -Infinity];
  for (const y of line.y) {
    if (y === null) continue;
    low = Math.min(low, y);
    high = Math.max(high, y);
  }
  return high >= low ? high - low : -1;
}

function draw() {
  const box = byId("trend");
  const all = lines();
  const most = chosen(all);
  const now = Math.max(liveMs, ...most.map((line) => line.x.at(-1) ?? 0)) || Date.now();
  const more = all.length - most.length;
  say(byId("trend-told"), error || (more > 0 ? word("operator-trend_more", { count: more }) : ""));
  const first = Math.min(now - LEAST_MS, ...most.map((line) => line.x[0] ?? now));
  drawChart(box, {
    still: true,
    time: true,
    first: Math.max(first, now - SPAN_MS),
    last: now,
    leastSpan: LEAST_UM,
    label: word("operator-trend_label"),
    yTitle: "µm",
    rightTitle: "°C",
    lines: most.map((line) => ({
      ...line,
      name: shortNames(line.name.replace(OFFSET, "$1")),
      unit: line.axis === "left" ? "µm" : "°C",
    })),
    marks: history.events.map(eventMark),
  });
}
