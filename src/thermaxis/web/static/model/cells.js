// @ts-check
/**
 * Cells that a template leaves to the status: `data-at` says at which places of it a cell's value
 * may stand, the first known one counts; `data-kind` what is made of it, a text without it.
 */
import { say } from "../elements.js";
import { number, signed, word } from "../words.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */
/** @typedef {boolean | null | "unused"} Good null where nobody knows, unused where none is judged */
/** @typedef {(value: any, given: DOMStringMap) => [Good, string]} Judge */

/** @type {Record<string, Judge>} */
const JUDGES = {
  weight: (weight) => [weight === null ? null : weight >= 1, weightWords(weight)],
  inside: (value, given) => {
    if (given.low === undefined) return [null, word("model-range_unknown")];
    if (value === null) return [null, word("model-no_value")];
    const distance = Math.max(Number(given.low) - value, value - Number(given.high));
    return distance <= 0 ? [true, word("model-inside")]
      : [false, word("model-outside", { distance: number(distance, 1) })];
  },
  quality: (input) => input ? [input.quality === "good", input.quality_said]
    : ["unused", word("sensors-not_in_model")],
  interlock: (sample, given) => {
    const met = flagOf(sample, given);
    if (met === null) return [false, word("sensors-not_read")];
    return [met, met ? word("sensors-met") : word("sensors-not_met")];
  },
  other: (sample, given) => {
    const active = flagOf(sample, given);
    if (active === null) return [null, word("sensors-not_read")];
    return [!active, active ? word("sensors-active") : word("sensors-not_active")];
  },
};

/** @param {Data} status */
export function fillLive(status) {
  for (const cell of /** @type {NodeListOf<HTMLElement>} */ (
    document.querySelectorAll("[data-at]"))) {
    const places = /** @type {string[][]} */ (JSON.parse(cell.dataset.at ?? "[]"));
    const value = places.map((place) => valueAt(status, place)).find((one) => one !== null) ?? null;
    const judge = JUDGES[cell.dataset.kind ?? ""];
    if (judge) showVerdict(cell, ...judge(value, cell.dataset));
    else if (cell.dataset.kind === "range") showRange(cell, value);
    else say(cell, textOf(value, cell.dataset));
  }
}

/** @param {Data} status @param {string[]} place @returns {any} */
function valueAt(status, place) {
  return place.reduce((/** @type {any} */ found, key) => found?.[key], status) ?? null;
}

/** @param {string | number | null} value @param {DOMStringMap} given @returns {string} */
function textOf(value, given) {
  if (value === null && given.none) return given.none;
  if (typeof value === "string") return value;
  const text = (given.signed === undefined ? number : signed)(value, Number(given.digits));
  return given.unit ? `${text} ${given.unit}` : text;
}

/** Whether a flag is as it is awaited. @param {Data | null} sample @param {DOMStringMap} given */
function flagOf(sample, given) {
  return sample?.good && sample.read !== null ? String(sample.read !== 0) === given.goodFlag : null;
}

/** @param {number | null} weight */
function weightWords(weight) {
  if (weight === null) return word("model-weight_unknown");
  if (weight >= 1) return word("model-weight_full");
  if (weight <= 0) return word("model-weight_none");
  return word("model-weight_part", { weight: number(100 * weight, 0) });
}

/** Show a value in its range, which takes 5/7 of the bar. @param {HTMLElement} range @param {number | null} value */
function showRange(range, value) {
  const now = /** @type {HTMLElement | null} */ (range.querySelector(".range-now"));
  const [low, high] = [Number(range.dataset.low), Number(range.dataset.high)];
  if (!now) return;
  now.hidden = value === null;
  if (value !== null) {
    const place = (1 + 5 * (value - low) / Math.max(high - low, 1e-9)) / 7;
    now.style.left = `${100 * Math.min(1, Math.max(0, place))}%`;
    now.classList.toggle("outside", value < low || value > high);
  }
  const [lowest, highest] = [number(low, 1), number(high, 1)];
  const text = word("model-range_said", { value: number(value, 1), lowest, highest });
  range.querySelector("[role=img]")?.setAttribute("aria-label", text);
}

/** Show a mark that needs no colour, and words. @param {HTMLElement} box @param {Good} good @param {string} text */
function showVerdict(box, good, text) {
  const sign = good === "unused" ? "–" : good === null ? "?" : good ? "✓" : "!";
  box.dataset.good = { "–": "unused", "?": "unknown", "✓": "yes", "!": "no" }[sign];
  say(box.children[0], sign);
  say(box.children[1], text);
}
