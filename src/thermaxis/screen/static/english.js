// @ts-check
// What stays English on a page of another language: sentences of free text, of the self-test, of a
// model that is refused. It is marked, so that a screen reader speaks it as English.

import { alarmWords, large, word } from "./words.js";

/** Gaps that hold sentences of free text; the server has the same list, and a test compares them. */
export const FREE_TEXT = ["detail", "failure", "finding", "problem", "said", "why"];
const foreign = document.documentElement.lang !== "en";

/**
 * An element with an English text.
 * @param {string} tag
 * @param {string} text
 * @param {string} [name] name of its class
 */
export function inEnglish(tag, text, name = "") {
  const made = document.createElement(tag);
  made.textContent = text;
  made.lang = "en";
  if (name) made.className = name;
  return made;
}

/**
 * A text as nodes, those parts of it marked that are English.
 * @param {string} text
 * @param {string[]} english parts of it, also where the text begins with a large letter
 * @returns {(string | HTMLElement)[]}
 */
export function withEnglish(text, english) {
  if (!foreign) return [text];
  let nodes = /** @type {(string | HTMLElement)[]} */ ([text]);
  for (const part of english) {
    nodes = nodes.flatMap((node) => typeof node === "string" ? split(node, part) : [node]);
  }
  return nodes;
}

/** @param {string} text @param {string} part @returns {(string | HTMLElement)[]} */
function split(text, part) {
  const found = [part, large(part)].find((one) => one !== "" && text.includes(one));
  if (found === undefined) return [text];
  const at = text.indexOf(found);
  const nodes = [text.slice(0, at), inEnglish("span", found), text.slice(at + found.length)];
  return nodes.filter((node) => node !== "");
}

/**
 * Write a text of which parts are English, only if it is another one.
 * @param {Element | null | undefined} element
 * @param {string} text
 * @param {string[]} english
 */
export function sayWithEnglish(element, text, english) {
  if (!element || element.textContent === text) return;
  element.replaceChildren(...withEnglish(text, english));
}

/**
 * What of an alarm stays English: all of it where this screen does not know it, else free text.
 * @param {Record<string, any>} alarm
 * @returns {string[]}
 */
export function englishOf(alarm) {
  if (!foreign) return [];
  if (alarmWords(/** @type {any} */ (alarm)) === alarm) {
    return [alarm.text, alarm.cause, alarm.remedy].map(String);
  }
  return FREE_TEXT.map((name) => alarm.values?.[name])
    .filter((value) => typeof value === "string" && value !== "");
}

/** The sentence that details come in English, for a place where some do; none on English pages. */
export function englishNote() {
  return foreign ? word("common.details_english") : "";
}
