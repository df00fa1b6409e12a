// @ts-check
// The corrections: a card for each axis, which shows as much as it has room for, and all of it in
// a dialog.

import { byId, made, overflows, say } from "../elements.js";
import { diameterWord, gainNow, isTrimmed, modelAsksUm } from "./parts.js";
import { duration, number, shortNames, signed, word } from "../words.js";

/** @typedef {Record<string, any>} Status */
/**
 * @typedef {object} Row
 * @property {string} key
 * @property {string} label
 * @property {string} value
 * @property {number} weight what weighs most stays longest
 * @property {boolean} marked
 * @property {string} owner who set it and for how long, beside the value where there is room
 */

const MOST_CARDS = 4;
const NARROW_PX = 280;
const OLD_S = 3; // an offset that is older is of the past, and not shown as what stands
const WEIGHT_OFFSET = 8; // so much or more is never left out: the three offsets, and a trim
const WEIGHT_TRIM = 9;
const LIMIT_ALARMS = ["limit", "soft_limit"];
const NEAR_LIMIT_UM = 1e-6;
/** All; without the trim's owner; without the numbers of the bar; without the bar. */
const TIGHT = ["0", "1", "2", "3"];

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
  const rateLimit = limits ? ` ${word("operator-rate_of", {
    limit: `±${number(limits.largest_rate_um_per_s, 2)}`,
  })}` : "";
  const trimmed = isTrimmed(axis);
  const inside = (axis.weight ?? 0) >= 1;
  return [
    row("commanded", word("operator-commanded"), offset(axis, "requested") + unit, WEIGHT_OFFSET),
    row("accepted", word("operator-accepted"), offset(axis, "accepted") + unit, WEIGHT_OFFSET),
    row("effective", word("operator-effective"), offset(axis, "effective") + unit, WEIGHT_OFFSET),
    trimmed ? trimRow(axis) : row("trim", word("operator-trim"), word("operator-trim_none"), 3),
    row("rate", word("operator-rate"),
      `${signed(axis.rate_um_per_s, 2)}${rateLimit}\u00a0µm/s`, 6),
    row("weight", word("operator-weight"), weightSaid(axis.weight),
      inside ? 4 : 7, axis.weight !== null && !inside),
    row("parts", word("operator-parts"), partsOf(status, name), 5),
    row("model", word("operator-model_asks"), signed(modelAsksUm(axis), 1) + unit, 2),
    row("wanted", word("operator-wanted"), signed(axis.wanted_um, 1) + unit, 1),
  ];
}

/** @param {any} axis @param {string} key */
function offset(axis, key) {
  return signed(axis[`${key}_age_s`] > OLD_S ? null : axis[`${key}_um`], 1);
}

/** @param {any} axis @returns {Row} */
function trimRow(axis) {
  const value = word("operator-trim_set", { value: signed(axis.trim_um, 1) });
  const owner = word("operator-trim_by", {
    owner: axis.trim_owner || "–", left: duration(axis.trim_left_s),
  });
  const found = row("trim", word("operator-trim"), value, WEIGHT_TRIM, true);
  return { ...found, owner: `, ${owner}` };
}

/** @param {number | null} weight */
function weightSaid(weight) {
  if (weight === null) return number(null, 0);
  const values = { weight: number(100 * weight, 0) };
  return weight >= 1
    ? word("operator-weight_full", values) : word("operator-weight_less", values);
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
  return { key, label, value, weight, marked, owner: "" };
}

/** @param {Status} status @param {string} name */
function partsOf(status, name) {
  const parts = Object.entries(status.outputs[name].parts_um);
  return parts.map(([part, um]) => {
    const gain = gainNow(status, name, part);
    const diameter = diameterWord(status.diameter_mm);
    const scaled = gain === null ? ""
      : ` (${word("operator-part_gain", { gain: number(gain, 2), diameter })})`;
    return `${part} ${signed(um, 1)}\u00a0µm${scaled}`;
  }).join(" · ");
}

/**
 * Where the correction itself stands.
 * @param {Status["outputs"][string]} axis
 * @returns {"at_limit" | "at_soft_limit" | "within"}
 */
function judged(axis) {
  const um = Math.abs(axis.correction_um ?? 0);
  if (axis.limits && um >= axis.limits.largest_um - NEAR_LIMIT_UM) return "at_limit";
  return axis.at_soft_limit ? "at_soft_limit" : "within";
}

/**
 * What is said of it, long and short: first that the model asks for more than is allowed, which
 * may be long before the correction comes there.
 * @param {Status["outputs"][string]} axis
 * @returns {[string, string]}
 */
function judgedWords(axis) {
  if (axis.at_limit) return [word("operator-over_limit"), word("operator-over_limit_short")];
  const said = { at_limit: word("operator-at_limit"), at_soft_limit: word("operator-at_soft_limit"),
    within: word("operator-within") }[judged(axis)];
  return [said, said];
}

/** Priority of the alarm that says of an output what its card says; empty without one.
 * @param {Status} status @param {string} name */
function priorityOf(status, name) {
  const alarm = status.alarms.find((/** @type {Record<string, any>} */ one) =>
    LIMIT_ALARMS.includes(one.code) && one.values?.name === name);
  return alarm?.priority ?? "";
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
  say(more, moreSaid(status, names.slice(shown.length)));
  shown.forEach((name, k) => {
    fillCard(/** @type {HTMLElement} */ (box.children[k]), status, name);
  });
  fitCards(box);
}

/** What is said of the axes that have no card; their trims are never out of sight.
 * @param {Status} status @param {string[]} names */
function moreSaid(status, names) {
  const trims = names.filter((name) => isTrimmed(status.outputs[name]))
    .map((name) => `${shortNames(name)} ${signed(status.outputs[name].trim_um, 1)}`);
  const values = { count: names.length, trims: trims.join(", ") };
  return trims.length ? word("operator-more_trimmed", values) : word("operator-more_axes", values);
}

/** @param {string} name */
function card(name) {
  const made_ = /** @type {HTMLButtonElement} */ (made("button", "", "op-card"));
  made_.type = "button";
  made_.setAttribute("aria-haspopup", "dialog");
  made_.addEventListener("click", () => { for (const open of openers) open(); });
  const head = made("span", "", "op-card-head");
  head.append(
    made("b", shortNames(name), "op-card-name"),
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
  const [long, short] = judgedWords(axis);
  element.dataset.judged = judged(axis);
  element.dataset.priority = priorityOf(status, name);
  say(element.querySelector(".op-value b"), signed(axis.correction_um, 1));
  const quiet = judged(axis) === "within" && !axis.at_limit;
  const alone = element.parentElement?.childElementCount === 1;
  say(element.querySelector(".op-judged"), quiet ? "" : alone ? long : short);
  fillBar(/** @type {HTMLElement} */ (element.querySelector(".op-bar")), axis, name);
  const lines = /** @type {HTMLElement} */ (element.querySelector(".op-lines"));
  fillRows(lines, rowsOf(status, name, ""));
}

/** @param {HTMLElement} lines @param {Row[]} rows */
export function fillRows(lines, rows) {
  if (lines.childElementCount !== rows.length) {
    lines.replaceChildren(...rows.map(({ key, label }) => {
      const line = made("span", "", "op-line");
      line.dataset.row = key;
      line.append(made("span", label, "op-label"), made("span", "", "op-said"));
      line.append(made("span", "", "op-owner"));
      return line;
    }));
  }
  rows.forEach((one, k) => {
    const line = /** @type {HTMLElement} */ (lines.children[k]);
    line.dataset.weight = String(one.weight);
    line.dataset.marked = one.marked ? "yes" : "no";
    say(line.children[1], one.value);
    say(line.children[2], one.owner);
  });
}

/** Take from all cards alike what has no room, until offsets and trims have theirs; then each
 * shows what else it can. @param {HTMLElement} box */
function fitCards(box) {
  const cards = /** @type {HTMLElement[]} */ ([...box.children]);
  for (const tight of TIGHT) {
    box.dataset.tight = tight;
    for (const card of cards) showRows(card, (line) => Number(line.dataset.weight) >= WEIGHT_OFFSET);
    if (!cards.some(isFull)) break;
  }
  for (const card of cards) {
    fitRows(card);
    const left = box.dataset.tight !== TIGHT[0] || card.querySelector(".op-line[hidden]") !== null;
    card.dataset.more = left ? "yes" : "no";
  }
}

/** @param {HTMLElement} card */
function isFull(card) {
  const head = card.querySelector(".op-card-head");
  const lines = /** @type {HTMLElement} */ (card.querySelector(".op-lines"));
  return overflows(card) || overflows(lines) || (head?.scrollWidth ?? 0) > card.clientWidth;
}

/** @param {HTMLElement} card @param {(line: HTMLElement) => boolean} shown */
function showRows(card, shown) {
  for (const line of card.querySelectorAll(".op-line")) {
    const one = /** @type {HTMLElement} */ (line);
    one.hidden = !shown(one);
  }
}

/** Show of the other rows what has room, the most important first. @param {HTMLElement} card */
function fitRows(card) {
  const all = /** @type {HTMLElement[]} */ ([...card.querySelectorAll(".op-line")]);
  const others = all.filter((line) => line.hidden);
  for (const line of others) line.hidden = false;
  if (!isFull(card)) return;
  for (const line of others) line.hidden = true;
  others.sort((a, b) => Number(b.dataset.weight) - Number(a.dataset.weight));
  for (const line of others) {
    line.hidden = false;
    line.hidden = isFull(card);
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
  const softWord = narrow ? "" : `${word("operator-soft")} `;
  const hardWord = `${word("operator-hard")} `;
  label(above?.children[0], at(-soft), `${softWord}${number(-soft, 0)}`);
  label(above?.children[1], at(soft), `${softWord}+${number(soft, 0)}`);
  label(below?.children[0], at(-hard), `${hardWord}${number(-hard, 0)}`);
  label(below?.children[1], 50, "0");
  label(below?.children[2], at(hard), `${hardWord}+${number(hard, 0)}`);
  element.setAttribute("aria-label", word("operator-correction_bar", {
    axis: shortNames(name), value: signed(now, 1), soft: number(soft, 0), hard: number(hard, 0),
  }));
}

/** Beside its place, but never out of the bar. @param {Element | undefined} element
 * @param {number} percent @param {string} text */
function label(element, percent, text) {
  say(element, text);
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
      head.append(made("b", shortNames(name), "op-card-name"), made("span", "", "op-judged"),
        made("span", "", "op-value"));
      head.lastElementChild?.append(made("b", "–"), made("span", "µm"));
      part.append(head, bar(), made("div", "", "op-lines"));
      return part;
    }));
  }
  names.forEach((name, k) => {
    const part = /** @type {HTMLElement} */ (body.children[k]);
    const axis = status.outputs[name];
    part.dataset.judged = axis.at_limit && judged(axis) === "within" ? "" : judged(axis);
    part.dataset.priority = priorityOf(status, name);
    say(part.querySelector(".op-value b"), signed(axis.correction_um, 1));
    say(part.querySelector(".op-judged"), judgedWords(axis)[0]);
    fillBar(/** @type {HTMLElement} */ (part.querySelector(".op-bar")), axis, name);
    const lines = /** @type {HTMLElement} */ (part.querySelector(".op-lines"));
    fillRows(lines, rowsOf(status, name, "\u00a0µm"));
  });
}
