// @ts-check
// Looks of lines, letters of marks, and the rows of the legend: sample, name, value.

import { milliseconds } from "./time.js";
import { made } from "../elements.js";
import { word } from "../words.js";

/** @typedef {{x: number, text: string, rank: number, letter: string, grave: boolean,
 *   asked: boolean}} Placed */

/** Strokes with round ends: a dash of no length is a dot. @type {Record<string, string>} */
const DASHES = {
  solid: "", dash: "6 5", dot: "0 4", dashdot: "6 4 0 4", longdash: "11 5", longdashdot: "11 5 0 5",
};
/** Paths from their middle. @type {Record<string, string>} */
const MARKERS = {
  circle: "m4 0a4 4 0 1 1-8 0a4 4 0 1 1 8 0z",
  square: "m-3.5-3.5h7v7h-7z",
  diamond: "m0-5l5 5l-5 5l-5-5z",
  "triangle-up": "m0-5l4.5 8.5h-9z",
  cross: "m-1.5-4.5h3v3h3v3h-3v3h-3v-3h-3v-3h3z",
  x: "m-4-2l2-2l2 2l2-2l2 2l-2 2l2 2l-2 2l-2-2l-2 2l-2-2l2-2z",
  none: "",
};
const MARK_ROOM_PX = 24;

/** @param {import("./chart.js").Line} line @param {number} k its place */
export function lookOf(line, k) {
  return {
    color: `chart-color-${line.color ?? (k % 6) + 1}`,
    dash: DASHES[line.dash ?? ""] ?? Object.values(DASHES)[k % 6] ?? "",
    marker: MARKERS[line.marker ?? ""] ?? Object.values(MARKERS)[(k + Math.floor(k / 6)) % 6] ?? "",
  };
}

/** @param {string} tag @param {Record<string, any>} attributes @param {(Node | string)[]} inner */
export function svg(tag, attributes, ...inner) {
  const found = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) found.setAttribute(name, String(value));
  found.append(...inner);
  return found;
}

/** @param {string} name of its class @param {string} dash @param {string} marker */
export function sample(name, dash, marker) {
  const box = { width: 40, height: 14, viewBox: "-20 -7 40 14", "aria-hidden": "true" };
  return svg("svg", { ...box, class: name },
    svg("path", { class: "chart-stroke", d: "M-19 0H19", "stroke-dasharray": dash }),
    svg("path", { class: "chart-marker", d: `M0 0${marker}` }));
}

/** @param {string} kind @param {Node | string} sign @param {string} text @param {string} [value] */
export function row(kind, sign, text, value = "") {
  const parts = [sign, made("span", text), value && made("strong", value)].filter(Boolean);
  return made("li", "", `chart-entry chart-entry-${kind}`, ...parts);
}

/** @param {import("./chart.js").Line} line @param {number} k its place @param {string} [value] */
export function lineRow(line, k, value) {
  const { color, dash, marker } = lookOf(line, k);
  const name = line.unit ? `${line.name} [${line.unit}]` : line.name;
  return row("line", sample(color, dash, marker), name, value);
}

// ---- marks -----------------------------------------------------------------------------------

/**
 * Return the marks that are shown, so many with a letter, or a number if a person asked for it: the
 * weightiest, then the latest, as far as there is room beside one another.
 * @param {import("./chart.js").Chart} chart
 * @param {import("./draw.js").Axis} axis
 * @param {number} width of the plot [px]
 * @param {number} most
 */
export function marksOf({ marks = [] }, { first, last }, width, most) {
  const room = MARK_ROOM_PX * (last - first) / Math.max(100, width - 90);
  const shown = marks.map(({ x, text, kind = "", rank = 1 }) => (/** @type {Placed} */ ({
    x: milliseconds(x), text, rank, grave: kind === "alarm", asked: kind === "request", letter: "",
  }))).filter(({ x }) => x >= first && x <= last)
    .sort((a, b) => Number(a.asked) - Number(b.asked) || a.x - b.x);
  const named = /** @type {Placed[]} */ ([]);
  for (const one of [...shown].sort((a, b) => a.rank - b.rank || b.x - a.x)) {
    const free = named.every(({ x, asked }) => asked !== one.asked || Math.abs(x - one.x) >= room);
    if (free && named.length < most) named.push(one);
  }
  const next = { happened: 65, asked: 1 }; // the first is an A, or a 1
  for (const one of shown.filter((mark) => named.includes(mark))) {
    one.letter = one.asked ? String(next.asked++) : String.fromCharCode(next.happened++);
  }
  return shown;
}

/** @param {Placed[]} marks */
export function markRows(marks) {
  const rows = marks.filter((one) => one.letter).map(({ letter, text, grave }) =>
    row("mark", made("b", letter, `chart-letter${grave ? " chart-letter-grave" : ""}`), text));
  const count = marks.length - rows.length;
  return count ? [...rows, row("more", "", word("chart-and_others", { count }))] : rows;
}
