// @ts-check
// Events in words, in the table.

import { duration, exactly, moment, phrase, shortNames, signed, word } from "./words.js";
import { englishNote, withEnglish } from "./english.js";
import { element } from "./past.js";

/** @typedef {Record<string, any>} Happened */

/** @type {Record<string, (event: Happened) => string>} */
const ASKED = {
  model: (event) => word("history.ask_model", { file: event.file }),
  trim: (event) => word("history.ask_trim", {
    output: shortNames(event.output),
    value: signed(event.value, 1),
    length: duration(event.duration_s),
  }),
  diameter: (event) => event.value === null
    ? word("history.ask_no_diameter")
    : word("history.ask_diameter", { value: exactly(event.value) }),
};

/** @param {Happened} event */
function kindText(event) {
  return phrase("event", event.kind);
}

/**
 * What happened; requests with what was asked for.
 * @param {Happened} event
 */
function eventText(event) {
  if (!("request" in event)) return event.said;
  const what = ASKED[event.request]?.(event) ?? phrase("request", event.request);
  const values = { what, reason: event.said_reason };
  return event.accepted
    ? word("history.asked_accepted", values)
    : word("history.asked_refused", values);
}

/** Show in the table what the server told. @param {{events: Happened[], more: boolean}} told */
export function showEvents({ events, more }) {
  const place = element("events");
  place.replaceChildren(...[...events].reverse().map(rowOf));
  const told = !events.length
    ? word("history.events_none")
    : more ? word("history.events_more", { count: events.length }) : "";
  const note = events.some((one) => one.english) ? englishNote() : "";
  element("events-told").textContent = [told, note].filter(Boolean).join(" ");
}

/** @param {Happened} event */
function rowOf(event) {
  const row = document.createElement("tr");
  for (const text of [moment(event.t), kindText(event), event.who]) {
    const cell = document.createElement("td");
    cell.textContent = text;
    row.append(cell);
  }
  const what = document.createElement("td");
  what.append(...withEnglish(eventText(event), event.english ?? []));
  row.append(what);
  return row;
}
