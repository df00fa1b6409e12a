// @ts-check
// Marks of a chart: neighbours share a letter, and what has no room for one goes by its weight.

import { milliseconds } from "./time.js";

/**
 * @typedef {import("./chart.js").Drawn} Drawn
 * @typedef {import("./chart.js").Axis} Axis
 */

const MARK_ROOM_PX = 24;
const STILL_MARKS = 8;

/**
 * @typedef {{x: number, letter: string, marks: Placed[], texts: string[], grave: boolean,
 *   rank: number, asked: boolean}} Cluster
 * @typedef {{x: number, text: string, kind?: string, rank: number}} Placed
 * @param {Drawn} drawn
 * @param {Axis} axis
 * @returns {Cluster[]} marks that have room for a letter each; neighbours share one, but what
 *   people asked for stands apart from what happened
 */
export function clustersOf({ chart, plot }, axis) {
  const perPx = (axis.last - axis.first) / Math.max(100, plot.clientWidth - 90);
  const clusters = /** @type {Cluster[]} */ ([]);
  const shown = (chart.marks ?? [])
    .map((mark) => ({ ...mark, x: milliseconds(mark.x), rank: mark.rank ?? 1 }))
    .filter((mark) => mark.x >= axis.first && mark.x <= axis.last)
    .sort((a, b) => a.x - b.x);
  for (const asked of [false, true]) {
    clusters.push(...gathered(shown.filter((mark) => asked === (mark.kind === "request")),
      MARK_ROOM_PX * perPx, asked));
  }
  for (const cluster of clusters) cluster.texts = textsOf(cluster.marks, axis.time);
  const most = chart.marksListed ?? (chart.still ? STILL_MARKS : clusters.length);
  nameMarks(clusters, most);
  return clusters;
}

/**
 * Give so many marks a letter, or a number to what was asked for: the weightiest, then the latest.
 * @param {Cluster[]} clusters
 * @param {number} most
 */
export function nameMarks(clusters, most) {
  const named = new Set([...clusters].sort((a, b) => a.rank - b.rank || b.x - a.x).slice(0, most));
  for (const asked of [false, true]) {
    let k = 0;
    for (const one of clusters) {
      if (one.asked !== asked) continue;
      one.letter = !named.has(one) ? "" : asked ? String(k + 1) : letterOf(k);
      if (named.has(one)) k += 1;
    }
  }
}

/** @param {Placed[]} marks @param {number} room @param {boolean} asked @returns {Cluster[]} */
function gathered(marks, room, asked) {
  const found = /** @type {Cluster[]} */ ([]);
  for (const mark of marks) {
    const before = found.at(-1);
    const grave = mark.kind === "alarm";
    if (before && mark.x - before.x < room) {
      before.marks.push(mark);
      before.grave ||= grave;
      before.rank = Math.min(before.rank, mark.rank);
    } else {
      const { x, rank } = mark;
      found.push({ x, letter: "", marks: [mark], texts: [], grave, rank, asked });
    }
  }
  return found;
}

/**
 * Texts of neighbours, the weightiest first, of those the latest; what came often stands there once.
 * @param {Placed[]} marks
 * @param {boolean} time
 */
function textsOf(marks, time) {
  const counts = new Map();
  const sorted = [...marks].sort((a, b) => a.rank - b.rank || (time ? b.x - a.x : 0));
  for (const { text } of sorted) counts.set(text, (counts.get(text) ?? 0) + 1);
  return [...counts].map(([text, count]) => (count > 1 ? `${text} (${count}×)` : text));
}

/** @param {number} k */
function letterOf(k) {
  const last = String.fromCharCode(65 + (k % 26));
  return k < 26 ? last : letterOf(Math.floor(k / 26) - 1) + last;
}

/** @param {Cluster} mark @param {Record<string, string>} paint */
export function markShape(mark, paint) {
  const line = mark.grave
    ? { color: paint.text, width: 2, dash: "solid" }
    : { color: paint.muted, width: 1, dash: "2px,3px" };
  return { type: "line", x0: mark.x, x1: mark.x, yref: "paper", y0: 0, y1: 1, line };
}

/** @param {Cluster} mark @param {Record<string, string>} paint */
export function markLetter(mark, paint) {
  const yanchor = mark.asked ? "top" : "bottom";
  const top = { yref: "paper", y: 1, yanchor, xanchor: "center", showarrow: false };
  const box = { bordercolor: mark.grave ? paint.text : paint.muted, borderwidth: 1, borderpad: 1 };
  return { x: mark.x, text: mark.letter, ...top, ...box, font: { color: paint.text, size: 11 } };
}
