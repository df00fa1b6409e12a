// @ts-check
// Looks of lines, letters of marks, and the rows of the legend: sample, name, value.

import { milliseconds } from "./time.js";
import { made } from "../elements.js";
import { word } from "../words.js";

/**
 * @typedef {{x: number, text: string, rank: number}} Placed
 * @typedef {{x: number, letter: string, marks: Placed[], grave: boolean, rank: number,
 *   asked: boolean}} Cluster
 */

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
const [MOST, MOST_STILL] = [26, 8];
const TEXTS_SHOWN = 3;

/** @param {import("./chart.js").Line} line @param {number} k its place */
export function lookOf(line, k) {
  return {
    color: `chart-color-${line.color ?? (k % 6) + 1}`,
    dash: DASHES[line.dash ?? ""] ?? Object.values(DASHES)[k % 6] ?? "",
    marker: MARKERS[line.marker ?? ""] ?? Object.values(MARKERS)[k % 6] ?? "",
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
 * Return marks that have room for a letter each; neighbours share one, but what people asked for
 * stands apart from what happened.
 * @param {import("./chart.js").Chart} chart
 * @param {import("./draw.js").Axis} axis
 * @param {number} width of the plot [px]
 */
export function clustersOf({ marks = [], marksListed, still }, { first, last }, width) {
  const room = MARK_ROOM_PX * (last - first) / Math.max(100, width - 90);
  const found = /** @type {Cluster[]} */ ([]);
  const shown = marks.map((mark) => ({ rank: 1, ...mark, x: milliseconds(mark.x) }))
    .filter(({ x }) => x >= first && x <= last)
    .sort((a, b) => Number(a.kind === "request") - Number(b.kind === "request") || a.x - b.x);
  for (const mark of shown) {
    const [before, grave, asked] = [found.at(-1), mark.kind === "alarm", mark.kind === "request"];
    if (before?.asked === asked && mark.x - before.x < room) {
      before.marks.push(mark);
      before.grave ||= grave;
      before.rank = Math.min(before.rank, mark.rank);
    } else found.push({ x: mark.x, letter: "", marks: [mark], grave, rank: mark.rank, asked });
  }
  letter(found, Math.min(MOST, marksListed ?? (still ? MOST_STILL : MOST)));
  return found;
}

/** Give so many a letter, or a number to what was asked for: the weightiest, then the latest.
 * @param {Cluster[]} clusters @param {number} most */
export function letter(clusters, most) {
  const named = new Set([...clusters].sort((a, b) => a.rank - b.rank || b.x - a.x).slice(0, most));
  const next = { happened: 65, asked: 1 }; // the first is an A, or a 1
  for (const one of clusters) {
    if (!named.has(one)) one.letter = "";
    else one.letter = one.asked ? String(next.asked++) : String.fromCharCode(next.happened++);
  }
}

/** @param {Cluster[]} clusters @param {boolean} still @param {boolean} latestFirst */
export function markRows(clusters, still, latestFirst) {
  const most = still ? 1 : TEXTS_SHOWN;
  const rows = clusters.filter((one) => one.letter).map(({ letter: sign, marks, grave }) => {
    const texts = textsOf(marks, latestFirst);
    const more = texts.length > most ? `+${texts.length - most}` : "";
    const name = grave ? "chart-letter chart-letter-grave" : "chart-letter";
    return row("mark", made("b", sign, name), texts.slice(0, most).join("; "), more);
  });
  const count = clusters.filter((one) => !one.letter).flatMap((one) => one.marks).length;
  const others = still ? `+${count}` : word("chart-and_others", { count });
  return count ? [...rows, row("more", "", others)] : rows;
}

/** Texts of neighbours, the weightiest first; what came often stands there once.
 * @param {Placed[]} marks @param {boolean} latestFirst */
function textsOf(marks, latestFirst) {
  const counts = new Map();
  const sorted = [...marks].sort((a, b) => a.rank - b.rank || (latestFirst ? b.x - a.x : 0));
  for (const { text } of sorted) counts.set(text, (counts.get(text) ?? 0) + 1);
  return [...counts].map(([text, count]) => (count > 1 ? `${text} (${count}×)` : text));
}
