// @ts-check
// Events in the table.

import { byId, hasEnglish, made } from "../elements.js";
import { moment, word } from "../words.js";

/** @typedef {Record<string, any>} Happened */

/** Show in the table what the server told. @param {{events: Happened[], more: boolean}} told */
export function showEvents({ events, more }) {
  byId("events").replaceChildren(...[...events].reverse().map(rowOf));
  const told = !events.length
    ? word("history-events_none")
    : more ? word("history-events_more", { count: events.length }) : "";
  const note = events.some((one) => hasEnglish(one.said)) ? word("common-details_english") : "";
  byId("events-told").textContent = [told, note].filter(Boolean).join(" ");
}

/** @param {Happened} event */
function rowOf(event) {
  const texts = [moment(event.t), event.kind_said, event.who, event.said];
  return made("tr", "", "", ...texts.map((text) => made("td", text)));
}
