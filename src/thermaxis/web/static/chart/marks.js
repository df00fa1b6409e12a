// @ts-check
// Marks of a chart: neighbours share a letter, and what has no room for one goes by its weight.

import { milliseconds } from "./time.js";

const MARK_ROOM_PX = 24;
const [MOST, MOST_STILL] = [26, 8];

/**
 * @typedef {{x: number, text: string, rank: number}} Placed
 * @typedef {{x: number, letter: string, marks: Placed[], grave: boolean, rank: number,
 *   asked: boolean}} Cluster
 *
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
  nameMarks(found, Math.min(MOST, marksListed ?? (still ? MOST_STILL : MOST)));
  return found;
}

/**
 * Give so many marks a letter, or a number to what was asked for: the weightiest, then the latest.
 * @param {Cluster[]} clusters
 * @param {number} most
 */
export function nameMarks(clusters, most) {
  const named = new Set([...clusters].sort((a, b) => a.rank - b.rank || b.x - a.x).slice(0, most));
  const next = { happened: 65, asked: 1 }; // the first is an A, or a 1
  for (const one of clusters) {
    if (!named.has(one)) one.letter = "";
    else one.letter = one.asked ? String(next.asked++) : String.fromCharCode(next.happened++);
  }
}

/** Texts of neighbours, the weightiest first; what came often stands there once. */
export function textsOf(/** @type {Placed[]} */ marks, /** @type {boolean} */ latestFirst) {
  const counts = new Map();
  const sorted = [...marks].sort((a, b) => a.rank - b.rank || (latestFirst ? b.x - a.x : 0));
  for (const { text } of sorted) counts.set(text, (counts.get(text) ?? 0) + 1);
  return [...counts].map(([text, count]) => (count > 1 ? `${text} (${count}×)` : text));
}
