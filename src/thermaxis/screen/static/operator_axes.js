// @ts-check
// The corrections: a card for each axis, which shows as much as it has room for, and all of it in
// a dialog.

import { made } from "./ask.js";
import { byId, gainNow, overflows, shortName, show, diameterWord } from "./operator_parts.js";
import { duration, number, signed, word } from "./words.js";

/** @typedef {Record<string, any>} Status */
/** @typedef {{key: string, label: string, value: string, weight: number, marked: boolean}} Row */

const MOST_CARDS = 4;
const NEAR_ZERO = 1e-9;
const NARROW_PX = 280;

/** @type {(() => void)[]} */
const openers = [];

/** @param {() => void} open */
export function onCard(open) {
  openers.push(open);
}

/**
 * What a card can say, besides value and bar; what weighs most stays longest.
 * @param {Status} status
 * @param {string} name
 * @param {string} unit empty where it stands above
 * @returns {Row[]}
 */
function rowsOf(status, name, unit) {
  const axis = status.outputs[name];
  const limits = axis.limits;
  const rateLimit = limits ? ` ${word("operator.rate_of", {
    limit: `±${number(limits.largest_rate_um_per_s, 2)}`,
  })}` : "";
  const trimmed = Math.abs(axis.trim_um ?? 0) > NEAR_ZERO;
  const inside = (axis.weight ?? 0) >= 1;
  return [
    row("commanded", word("operator.commanded"), signed(axis.requested_um, 1) + unit, 8),
    row("accepted", word("operator.accepted"), signed(axis.accepted_um, 1) + unit, 8),
    row("effective", word("operator.effective"), signed(axis.effective_um, 1) + unit, 8),
    row("trim", word("operator.trim"), trimmed ? word("operator.trim_set", {
      value: signed(axis.trim_um, 1), owner: axis.trim_owner || "–",
      left: duration(axis.trim_left_s),
    }) : word("operator.trim_none"), trimmed ? 9 : 3, trimmed),
    row("rate", word("operator.rate"),
      `${signed(axis.rate_um_per_s, 2)}${rateLimit}\u00a0µm/s`, 6),
    row("weight", word("operator.weight"), weightSaid(axis.weight),
      inside ? 4 : 7, axis.weight !== null && !inside),
    row("parts", word("operator.parts"), partsOf(status, name), 5),
    row("wanted", word("operator.wanted"), signed(axis.wanted_um, 1) + unit, 2),
  ];
}

/** @param {number | null} weight */
function weightSaid(weight) {
  if (weight === null) return number(null, 0);
  const values = { weight: number(100 * weight, 0) };
  return weight >= 1
    ? word("operator.weight_full", values) : word("operator.weight_less", values);
}

/**
 * @param {string} key
 * @param {string} label
 * @param {string} value
 * @param {number} weight
 * @param {boolean} [marked]
 * @returns {Row}
 */
function row(key, label, value, weight, marked = false) {
  return { key, label, value, weight, marked };
}

/** @param {Status} status @param {string} name */
function partsOf(status, name) {
  const parts = Object.entries(status.outputs[name].parts_um);
  return parts.map(([part, um]) => {
    const gain = gainNow(status, name, part);
    const diameter = diameterWord(status.diameter_mm);
    const scaled = gain === null ? ""
      : ` (${word("operator.part_gain", { gain: number(gain, 2), diameter })})`;
    return `${part} ${signed(um, 1)}\u00a0µm${scaled}`;
  }).join(" · ");
}

/** @param {Status["outputs"][string]} axis @returns {"at_limit" | "at_soft_limit" | "within"} */
function judged(axis) {
  if (axis.at_limit) return "at_limit";
  return axis.at_soft_limit ? "at_soft_limit" : "within";
}

/** @param {string} judgement */
function judgedWord(judgement) {
  if (judgement === "at_limit") return word("operator.at_limit");
  return judgement === "at_soft_limit" ? word("operator.at_soft_limit") : word("operator.within");
}

/** @param {Status} status */
export function showAxes(status) {
  const box = byId("cards");
  const names = Object.keys(status.outputs);
  const shown = names.length > MOST_CARDS ? names.slice(0, MOST_CARDS) : names;
  if (box.dataset.names !== JSON.stringify(shown)) {
    box.dataset.names = JSON.stringify(shown);
    box.dataset.count = String(shown.length);
    box.replaceChildren(...shown.map(card));
  }
  const more = byId("cards-more");
  more.hidden = names.length <= MOST_CARDS;
  show(more, word("operator.more_axes", { count: names.length - shown.length }));
  shown.forEach((name, k) => {
    fillCard(/** @type {HTMLElement} */ (box.children[k]), status, name);
  });
}

/** @param {string} name */
function card(name) {
  const made_ = /** @type {HTMLButtonElement} */ (made("button", "", "op-card"));
  made_.type = "button";
  made_.setAttribute("aria-haspopup", "dialog");
  made_.addEventListener("click", () => { for (const open of openers) open(); });
  const head = made("span", "", "op-card-head");
  head.append(
    made("b", shortName(name), "op-card-name"),
    made("span", "", "op-judged"),
    made("span", "", "op-value"),
  );
  head.lastElementChild?.append(made("b", "–"), made("span", "µm"));
  made_.append(head, bar(), made("span", "", "op-lines"));
  return made_;
}

/** @param {HTMLElement} element @param {Status} status @param {string} name */
function fillCard(element, status, name) {
  const axis = status.outputs[name];
  const judgement = judged(axis);
  element.dataset.judged = judgement;
  show(element.querySelector(".op-value b"), signed(axis.correction_um, 1));
  show(element.querySelector(".op-judged"), judgement === "within" ? "" : judgedWord(judgement));
  fillBar(/** @type {HTMLElement} */ (element.querySelector(".op-bar")), axis, name);
  const lines = /** @type {HTMLElement} */ (element.querySelector(".op-lines"));
  fillRows(lines, rowsOf(status, name, ""));
  fitRows(element, lines);
}

/** @param {HTMLElement} lines @param {Row[]} rows */
export function fillRows(lines, rows) {
  if (lines.childElementCount !== rows.length) {
    lines.replaceChildren(...rows.map(({ key, label }) => {
      const line = made("span", "", "op-line");
      line.dataset.row = key;
      line.append(made("span", label, "op-label"), made("span", "", "op-said"));
      return line;
    }));
  }
  rows.forEach((one, k) => {
    const line = /** @type {HTMLElement} */ (lines.children[k]);
    line.dataset.weight = String(one.weight);
    line.dataset.marked = one.marked ? "yes" : "no";
    show(line.lastElementChild, one.value);
  });
}

/**
 * Show what has room, the most important first; the three values of the read-back stay or go
 * together.
 * @param {HTMLElement} element
 * @param {HTMLElement} lines
 */
function fitRows(element, lines) {
  const all = /** @type {HTMLElement[]} */ ([...lines.children]);
  for (const line of all) line.hidden = false;
  if (!overflows(element) && !overflows(lines)) return;
  for (const line of all) line.hidden = true;
  const weights = [...new Set(all.map((line) => Number(line.dataset.weight)))];
  for (const weight of weights.sort((a, b) => b - a)) {
    const group = all.filter((line) => Number(line.dataset.weight) === weight);
    for (const line of group) line.hidden = false;
    if (!overflows(element) && !overflows(lines)) continue;
    for (const line of group) line.hidden = true;
  }
}

// ---- the bar ---------------------------------------------------------------------------------

export function bar() {
  const made_ = made("span", "", "op-bar");
  made_.setAttribute("role", "img");
  const track = made("span", "", "op-track");
  for (const name of ["soft-low", "soft-high", "fill", "zero", "low", "high", "goal"]) {
    track.append(made("i", "", `op-${name}`));
  }
  const above = made("span", "", "op-scale op-scale-soft");
  const below = made("span", "", "op-scale op-scale-hard");
  above.append(made("span", ""), made("span", ""));
  below.append(made("span", ""), made("span", "0"), made("span", ""));
  made_.append(above, track, below);
  return made_;
}

/** @param {HTMLElement} element @param {Status["outputs"][string]} axis @param {string} name */
export function fillBar(element, axis, name) {
  const { limits } = axis;
  element.hidden = !limits;
  if (!limits) return;
  const now = axis.correction_um ?? 0;
  const [soft, hard] = [limits.soft_um, limits.largest_um];
  const end = 1.04 * Math.max(limits.total_um, hard, Math.abs(now));
  /** @param {number} um */
  const at = (um) => 50 + (50 * um) / end;
  /** @param {string} part @param {number} from @param {number} to */
  const place = (part, from, to) => {
    const found = /** @type {HTMLElement} */ (element.querySelector(`.op-${part}`));
    found.style.left = `${at(Math.min(from, to))}%`;
    found.style.width = `${at(Math.max(from, to)) - at(Math.min(from, to))}%`;
  };
  place("soft-low", -end, -soft);
  place("soft-high", soft, end);
  place("fill", 0, now);
  place("low", -hard, -hard);
  place("high", hard, hard);
  place("goal", axis.wanted_um ?? now, axis.wanted_um ?? now);
  const [above, below] = [...element.querySelectorAll(".op-scale")];
  const narrow = element.clientWidth > 0 && element.clientWidth < NARROW_PX;
  const softWord = narrow ? "" : `${word("operator.soft")} `;
  const trimmed = narrow && Math.abs(axis.trim_um ?? 0) > NEAR_ZERO;
  const hardWord = trimmed ? "" : `${word("operator.hard")} `;
  label(above?.children[0], at(-soft), `${softWord}${number(-soft, 0)}`);
  label(above?.children[1], at(soft), `${softWord}+${number(soft, 0)}`);
  label(below?.children[0], at(-hard), `${hardWord}${number(-hard, 0)}`);
  label(below?.children[1], 50, trimmed
    ? word("operator.trim_short", { value: signed(axis.trim_um, 1) }) : "0");
  label(below?.children[2], at(hard), `${hardWord}+${number(hard, 0)}`);
  below?.children[1]?.classList.toggle("op-trimmed", trimmed);
  element.setAttribute("aria-label", word("operator.correction_bar", {
    axis: shortName(name), value: signed(now, 1), soft: number(soft, 0), hard: number(hard, 0),
  }));
}

/** Beside its place, but never out of the bar. @param {Element | undefined} element
 * @param {number} percent @param {string} text */
function label(element, percent, text) {
  show(element, text);
  const { style } = /** @type {HTMLElement} */ (element);
  style.left = `${percent}%`;
  style.transform = `translateX(-${percent}%)`;
}

// ---- all of it -------------------------------------------------------------------------------

/** @param {HTMLElement} body @param {Status} status */
export function fillDetails(body, status) {
  const names = Object.keys(status.outputs);
  if (body.dataset.names !== JSON.stringify(names)) {
    body.dataset.names = JSON.stringify(names);
    body.replaceChildren(...names.map((name) => {
      const part = made("section", "", "op-full");
      const head = made("p", "", "op-card-head");
      head.append(made("b", shortName(name), "op-card-name"), made("span", "", "op-judged"),
        made("span", "", "op-value"));
      head.lastElementChild?.append(made("b", "–"), made("span", "µm"));
      part.append(head, bar(), made("div", "", "op-lines"));
      return part;
    }));
  }
  names.forEach((name, k) => {
    const part = /** @type {HTMLElement} */ (body.children[k]);
    const axis = status.outputs[name];
    part.dataset.judged = judged(axis);
    show(part.querySelector(".op-value b"), signed(axis.correction_um, 1));
    show(part.querySelector(".op-judged"), judgedWord(judged(axis)));
    fillBar(/** @type {HTMLElement} */ (part.querySelector(".op-bar")), axis, name);
    const lines = /** @type {HTMLElement} */ (part.querySelector(".op-lines"));
    fillRows(lines, rowsOf(status, name, "\u00a0µm"));
  });
}
