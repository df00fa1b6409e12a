// @ts-check
// What happened, as a mark of a chart: its name in few words, and how much it weighs.

/** @typedef {Record<string, any>} Happened */
/** @typedef {{x: number, text: string, kind: string, rank: number}} EventMark */

/**
 * @param {Happened} event as the server tells it
 * @returns {EventMark}
 */
export function eventMark({ t, kind, mark, rank, state, priority }) {
  const shown = state === "Fault" ? "alarm" : kind === "alarm" && !priority ? "gone" : kind;
  return { x: t, text: mark, kind: shown, rank };
}
