// @ts-check
// The drawing of a chart: axes, bands, lines and marks, in the colours of the page's style.

import { lookOf, svg } from "./legend.js";
import { areaPath, isNumber, linePath, numberTicks, rangeOf } from "./scale.js";
import { timeTicks, zoneNames } from "./time.js";
import { number, pageLocale, word } from "../words.js";

/**
 * @typedef {import("./chart.js").Chart} Chart
 * @typedef {{time: boolean, first: number, last: number, end: number, unknown: boolean,
 *   empty: boolean, lines: number[][]}} Axis
 */

const MOST_MARKERS = 12;
const TICK_PX = { time: 84, x: 64, y: 32 };

/** Return a drawing, and where its data are [px].
 * @param {Chart} chart @param {Axis} axis @param {import("./legend.js").Placed[]} marks
 * @param {number} width @param {number} height */
export function drawingOf(chart, axis, marks, width, height) {
  const em = 0.8125 * (parseFloat(getComputedStyle(document.documentElement).fontSize) || 16);
  const zone = axis.time && !axis.unknown && !chart.still
    ? zoneNames([axis.first, axis.last], pageLocale) : "";
  const below = chart.xTitle ?? (zone && word("chart-local_time", { zone }));
  const bottom = height - em * ((axis.time ? 2.7 : 1.6) + (below ? 1.4 : 0));
  const requested = marks.some(({ letter, asked }) => letter && asked) ? 18 : 0;
  const top = (marks.length ? 24 : 8) + requested;
  const left = sideOf(chart, "left", axis.empty, bottom, top);
  const right = sideOf(chart, "right", axis.empty, bottom, top);
  const [begin, end] = [em * left.ems + 8, width - (right.ems ? em * right.ems + 8 : 16)];
  const toX = (/** @type {number} */ x) =>
    begin + (x - axis.first) / (axis.last - axis.first) * (end - begin);
  const drawing = svg("svg", { width, height, "font-size": em });
  /** @param {number} x @param {number} y @param {string} said */
  const text = (x, y, said, more = {}) =>
    drawing.append(svg("text", { x, y, "text-anchor": "middle", ...more }, said));
  const path = (/** @type {string} */ name, /** @type {string} */ d, to = drawing) =>
    to.append(svg("path", { d, class: `chart-${name}` }));

  const ticks = xTicks(axis, width, chart.whole);
  ticks.at.forEach((at, k) => {
    path("grid", `M${toX(at)} ${top}V${bottom}`);
    ticks.texts[k]?.split("\n").forEach((said, line) => {
      const x = Math.min(toX(at), width - 0.3 * em * said.length);
      text(x, bottom + em * (1.3 + 1.1 * line), said);
    });
  });
  for (const at of left.at) {
    path(Math.abs(at) < 1e-9 ? "axis" : "grid", `M${begin} ${left.toY(at)}H${end}`);
  }
  for (const [side, x, titleX, anchor] of /** @type {const} */ ([
    [left, begin - 5, em, "end"], [right, end + 5, width - 0.5 * em, "start"],
  ])) {
    side.at.forEach((at, k) => text(x, side.toY(at) + 0.35 * em, side.texts[k] ?? "",
      { "text-anchor": anchor, class: "chart-y" }));
    const turn = `translate(${titleX} ${(top + bottom) / 2}) rotate(-90)`;
    if (side.ems && side.title) text(0, 0, side.title, { transform: turn });
  }
  path("axis chart-frame", `M${begin} ${top}V${bottom}H${end}`);
  const middle = (begin + end) / 2;
  if (below) text(middle, height - 0.4 * em, below);
  if (axis.empty) text(middle, (top + bottom) / 2, word("chart-nothing"));

  const place = { x: begin, y: top, width: Math.max(1, end - begin), height: bottom - top };
  const inside = svg("svg", { ...place, viewBox: Object.values(place).join(" ") });
  drawing.append(inside);
  for (const { low, high } of chart.bands ?? []) {
    const [from, to] = [left.toY(low ?? high ?? 0), left.toY(high ?? low ?? 0)];
    path(from === to ? "limit" : "band", `M${begin} ${from}H${end}V${to}H${begin}`, inside);
  }
  const markers = chart.lines.map((line, k) => {
    const [x, look] = [axis.lines[k] ?? [], lookOf(line, k)];
    const { y, low, high, markers = MOST_MARKERS } = line;
    const toY = line.axis === "right" ? right.toY : left.toY;
    if (low && high) path(`area ${look.color}`, areaPath(x, low, high, toX, toY), inside);
    const there = x.map((_, n) => n)
      .filter((n) => isNumber(y[n]) && x[n] >= axis.first && x[n] <= axis.last);
    const every = Math.ceil(there.length / markers);
    const spots = there.filter((_, n) => look.marker && n % every === 0)
      .map((n) => `M${toX(x[n]).toFixed(1)} ${toY(y[n]).toFixed(1)}${look.marker}`);
    const d = linePath(x, y, toX, toY);
    const of = { class: `chart-line ${look.color}` };
    inside.append(svg("g", of, svg("path",
      { class: "chart-stroke", d, "stroke-dasharray": look.dash })));
    return svg("g", of, svg("path", { class: "chart-marker", d: spots.join("") }));
  });
  drawing.append(...markers); // whole at the edge, where lines end
  for (const { x: at, grave, letter, asked } of marks) {
    const [y, half] = [top - 12 - (asked ? 0 : requested), 4 + 3.5 * letter.length];
    path(grave ? "mark chart-grave" : "mark", `M${toX(at)} ${top}V${letter ? bottom : top + 6}`);
    if (!letter) continue;
    const x = Math.min(Math.max(toX(at), begin + half), end - half);
    path(grave ? "box chart-grave" : "box", `M${x - half} ${y - 8}h${2 * half}v16h${-2 * half}z`);
    text(x, y + 4, letter, { class: "chart-mark-letter", "font-size": 11 });
  }
  return { drawing, frame: { begin, end, top, bottom } };
}

/** What an axis at a side shows, and how many letters wide it is.
 * @param {Chart} chart @param {"left" | "right"} side @param {boolean} empty
 * @param {number} bottom @param {number} top */
function sideOf(chart, side, empty, bottom, top) {
  const left = side === "left";
  const own = chart.lines.filter((line) => (line.axis ?? "left") === side);
  const edges = left ? (chart.bands ?? []).flatMap(({ low, high }) => [low, high]) : [];
  const values = own.flatMap(({ y, low = [], high = [] }) => [y, low, high]).flat().concat(edges);
  const found = empty ? null : rangeOf(values, left ? chart.leastSpan : 0);
  const [low, high] = found ?? [0, 1];
  const { at, digits } = numberTicks(low, high, (bottom - top) / TICK_PX.y);
  const texts = found ? at.map((y) => number(y, digits)) : [];
  const title = (left ? chart.yTitle : chart.rightTitle) ?? "";
  const ems = 0.62 * Math.max(0, ...texts.map((one) => one.length)) + (title ? 1.5 : 0);
  const toY = (/** @type {number} */ y) => bottom - (y - low) / (high - low) * (bottom - top);
  return { at: found ? at : [], texts, title, ems: own.length ? ems : 0, toY };
}

/** @param {Axis} axis @param {number} width @param {boolean} [whole] numbers that count something
 * @returns {{at: number[], texts: string[]}} */
function xTicks({ first, last, time, unknown }, width, whole) {
  if (unknown) return { at: [], texts: [] };
  if (time) return timeTicks(first, last, Math.floor((width - 90) / TICK_PX.time), pageLocale);
  const { at, digits } = numberTicks(first, last, width / TICK_PX.x, whole ? 1 : 0);
  return { at, texts: at.map((x) => number(x, digits)) };
}
