// @ts-check
// What happened, as a mark of a chart: its name in few words, and how much it weighs.

import { phrase, word } from "./words.js";

/** @typedef {Record<string, any>} Happened */
/** @typedef {{x: number, text: string, kind: string, rank: number}} EventMark */

const LONGEST = 44;
const GRAVE = ["critical", "high"];
const RANKS = { loss: 1, start: 2, stop: 2, commission: 2, connection: 3 };

/**
 * @param {Happened} event as the server tells it
 * @returns {EventMark}
 */
export function eventMark(event) {
  const said = String(event.said ?? event.text ?? "");
  if (event.kind === "state" && event.state) {
    const fault = event.state === "Fault";
    const text = word(`operator.state_${String(event.state).toLowerCase()}`);
    return { x: event.t, text, kind: fault ? "alarm" : "state", rank: fault ? 0 : 1 };
  }
  if (event.kind === "request") {
    const asked = event.request ? phrase("request", event.request) : said;
    const text = `${event.accepted === false ? "✕ " : ""}${shortened(asked)}`;
    return { x: event.t, text: event.who ? `${text} (${event.who})` : text, kind: "request",
      rank: 4 };
  }
  if (event.kind === "alarm") return alarmOf(event, said);
  const rank = RANKS[/** @type {keyof typeof RANKS} */ (event.kind)] ?? 3;
  return { x: event.t, text: shortened(said), kind: event.kind, rank };
}

/** @param {Happened} event @param {string} said with its priority before it @returns {EventMark} */
function alarmOf(event, said) {
  const gone = event.priority === "";
  const named = gone || !event.priority ? said : said.slice(said.indexOf(": ") + 1);
  const text = shortened(named) || word("operator.alarm");
  const rank = GRAVE.includes(event.priority) ? 0 : gone ? 5 : 2;
  return { x: event.t, text, kind: gone ? "gone" : "alarm", rank };
}

/** The first sentence, cut between words. @param {string} said */
function shortened(said) {
  const first = (said.trim().split(/[.;(](?:\s|$)|\s\(/)[0] ?? "").replace(/\.$/, "");
  if (first.length <= LONGEST) return first;
  const cut = first.slice(0, LONGEST);
  return `${cut.slice(0, Math.max(12, cut.lastIndexOf(" ")))} …`;
}
