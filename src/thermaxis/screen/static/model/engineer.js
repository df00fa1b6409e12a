// @ts-check
/** What the engineer's pages are made from: tables, bars of a range, verdicts. */
import { made, say } from "../elements.js";
import { number, word } from "../words.js";

/**
 * @typedef {string | HTMLElement | {number: string | HTMLElement}} Cell a text, an element, or
 *   a number
 */

/**
 * Write a table anew.
 * @param {HTMLElement} table
 * @param {Cell[]} head
 * @param {Cell[][]} rows
 */
export function fillTable(table, head, rows) {
  const top = made("thead");
  const first = rows[0] ?? [];
  const asNumber = (/** @type {Cell} */ cell, /** @type {number} */ k) =>
    typeof first[k] === "object" && "number" in first[k] ? { number: String(cell) } : cell;
  top.append(rowOf(head.map(asNumber), "th"));
  const body = made("tbody");
  body.append(...rows.map((cells) => rowOf(cells, "td")));
  table.replaceChildren(top, body);
}

/** @param {Cell[]} cells @param {string} tag */
function rowOf(cells, tag) {
  const row = made("tr");
  for (const cell of cells) {
    const item = made(tag);
    if (typeof cell === "string") item.textContent = cell;
    else if (cell instanceof HTMLElement) item.append(cell);
    else if (cell) {
      item.append(cell.number);
      item.className = "number";
    }
    if (tag === "th") item.setAttribute("scope", "col");
    row.append(item);
  }
  return row;
}

/**
 * Make a part of the page with a title.
 * @param {string} title
 * @param {(HTMLElement | string)[]} content
 */
export function panel(title, ...content) {
  const section = made("section", "", "panel");
  section.append(made("h2", title), ...content);
  return section;
}

/** @param {HTMLElement} section across the page */
export function whole(section) {
  section.classList.add("whole");
  return section;
}

/** A box that scrolls where the table is too wide for it. @param {HTMLElement} table */
export function wide(table) {
  const box = made("div", "", "wide");
  box.append(table);
  return box;
}

/**
 * Make a bar that shows where a value stands in its range.
 * @returns {HTMLElement}
 */
export function rangeBar() {
  const range = made("div", "", "range");
  const track = made("div", "", "range-track");
  track.setAttribute("role", "img");
  track.append(made("div", "", "range-inside"), made("div", "", "range-now"));
  const ends = made("div", "", "range-ends");
  ends.append(made("span"), made("span"));
  range.append(track, ends);
  return range;
}

/**
 * Show a value in its range.
 * @param {HTMLElement} range made by `rangeBar`
 * @param {{low: number | null, high: number | null, value: number | null, digits?: number}} given
 */
export function showRange(range, { low, high, value, digits = 1 }) {
  const [track, ends] = range.children;
  const [inside, now] = /** @type {HTMLElement[]} */ ([...(track?.children ?? [])]);
  if (!track || !ends || !inside || !now) return;
  const known = low !== null && high !== null;
  range.hidden = !known;
  if (!known) return;
  const room = Math.max((high - low) * 0.2, 1e-9);
  const place = (/** @type {number} */ x) =>
    Math.min(100, Math.max(0, (100 * (x - low + room)) / (high - low + 2 * room)));
  inside.style.left = `${place(low)}%`;
  inside.style.right = `${100 - place(high)}%`;
  now.hidden = value === null;
  if (value !== null) now.style.left = `${place(value)}%`;
  now.classList.toggle("outside", value !== null && (value < low || value > high));
  const [first, last] = /** @type {HTMLElement[]} */ ([...ends.children]);
  for (const [end, x] of /** @type {[HTMLElement | undefined, number][]} */ ([
    [first, low],
    [last, high],
  ])) {
    if (!end) continue;
    say(end, number(x, digits));
    end.style.left = `${place(x)}%`;
  }
  const [lowest, highest] = [number(low, digits), number(high, digits)];
  const text = word("model-range_said", { value: number(value, digits), lowest, highest });
  if (track.getAttribute("aria-label") !== text) track.setAttribute("aria-label", text);
}

/** Make a verdict: a mark that needs no colour, and words. */
export function verdict() {
  const box = made("span", "", "verdict");
  const mark = made("span", "", "verdict-mark");
  mark.setAttribute("aria-hidden", "true");
  box.append(mark, made("span"));
  return box;
}

/**
 * Show a verdict.
 * @param {HTMLElement} box made by `verdict`
 * @param {boolean | null | "unused"} good null where nobody knows, unused where nothing is judged
 * @param {string} text
 */
export function showVerdict(box, good, text) {
  const [mark, words] = /** @type {HTMLElement[]} */ ([...box.children]);
  const sign = good === "unused" ? "–" : good === null ? "?" : good ? "✓" : "!";
  box.dataset.good = { "–": "unused", "?": "unknown", "✓": "yes", "!": "no" }[sign];
  if (mark) say(mark, sign);
  if (words) say(words, text);
}
