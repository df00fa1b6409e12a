// @ts-check
// The offsets: what acts in large letters, beside it what is commanded and wanted, and what adds
// up to it: the temperature difference and the signed share of every source, trim, what is held back.

import { byId, made, say } from "../elements.js";
import { diameterWord } from "../ask/requests.js";
import { facts, gainNow, isTouched, isTrimmed, modelAsksUm } from "./parts.js";
import { duration, number, shortNames, signed, timeOf, word } from "../words.js";

/** @typedef {Record<string, any>} Status */
/** @typedef {{key: string, name: string, k: string, um: number | null, part?: string}} Share */

const MOST_CARDS = 4;
const MOST_SOURCES = [0, 4, 3, 2]; // by the number of outputs
const AGED_S = 3; // what was read longer ago says when
const LEAST_REST_UM = 0.05;
const LEAST_SPAN_UM = 10;
const NEAR_LIMIT_UM = 1e-6;
const WELL = ["", "believed", "confirmed"]; // what became of a touch
const TO_ZERO = ["Off", "Fading", "Fault"];

/** Make a text as narrow as its room, never taller or lower. @param {HTMLElement} element */
export function fit(element) {
  const room = element.parentElement?.clientWidth ?? 0;
  const part = room / Math.max(1, element.offsetWidth);
  element.style.transform = part < 1 ? `scaleX(${part})` : "";
}

/** What acts, and whether it is known now; null where it was never read.
 * @param {Record<string, any>} axis @param {number} sinceS time since the status @param {boolean} live */
function actingOf(axis, sinceS, live) {
  const known = axis.acting_known && axis.acting_um !== null && live;
  const ageS = (axis.acting_age_s ?? NaN) + sinceS;
  const values = { value: signed(axis.acting_um, 1), age: duration(ageS) };
  const aged = !known || ageS > AGED_S;
  return {
    known,
    big: known ? values.value : "?",
    said: !aged ? "" : axis.acting_um === null
      ? word("operator-never_read") : word("operator-last_read", values),
  };
}

/** What was written a moment ago; null where nothing is. @param {Record<string, any>} axis
 * @returns {number | null} */
function commandedUm(axis) {
  return axis.requested_age_s === null || axis.requested_age_s > AGED_S ? null : axis.requested_um;
}

/** What inputs and control give; null where one of them is not read.
 * @param {Status} status @param {any} axis @param {number | null} um */
const ofBoth = (status, axis, um) => (status.source_connected && axis.acting_known ? um : null);

/** Where it goes when it follows the model; null where that is not known.
 * @param {Status} status @param {any} axis @returns {number | null} */
export const goalUm = (status, axis) =>
  Object.values(axis.differences_k).includes(null) ? null : ofBoth(status, axis, axis.wanted_um);

/** Where it goes, while it goes anywhere but to zero. @param {Status} status @param {any} axis */
const wantedUm = (status, axis) =>
  TO_ZERO.includes(status.state) ? null : goalUm(status, axis);

/** What is not known makes a sum unknown.
 * @param {number | null} sum @param {{um: number | null}} one */
function plus(sum, one) {
  return sum === null || one.um === null ? null : sum + one.um;
}

/** What adds up to the correction, in the order of the model, and their sum. @param {Status} status
 * @param {string} output @param {number} most sources that are told apart */
function sharesOf(status, output, most) {
  const axis = status.outputs[output];
  /** @type {Share[]} */
  const shares = Object.entries(axis.sources_um).map(([part, um]) => {
    const k = axis.differences_k?.[part] ?? null;
    return { key: "source", name: shortNames(part), part, k: `${signed(k, 1)}\u00a0K`,
      um: k === null ? k : ofBoth(status, axis, um) };
  });
  if (shares.length > most) {
    const others = shares.splice(most - 1);
    shares.push({ key: "source", name: word("operator-others", { count: others.length }), k: "",
      um: others.reduce(plus, 0) });
  }
  if (isTrimmed(axis)) {
    shares.push({ key: "trim", name: word("operator-trim_manual"), k: "", um: axis.trim_um });
  }
  if (isTouched(axis)) {
    const key = axis.offset_void ? "operator-touches_void"
      : axis.offset_acts ? "operator-touches_of" : "operator-touches_shown";
    const values = { known: signed(axis.offset_known_um, 1), std: number(axis.offset_std_um, 1) };
    shares.push({ key: "touch", name: word(key, values), k: "", um: axis.offset_um });
  }
  if (status.state === "Off") return shares; // nothing comes of them
  if (Math.abs(axis.rest_um) >= LEAST_REST_UM && shares.reduce(plus, 0) !== null) {
    shares.push({ key: "rest", name: word("operator-rest"), k: "", um: axis.rest_um });
  }
  const um = ofBoth(status, axis, axis.correction_um);
  return [...shares, { key: "sum", name: word("operator-sum"), k: "", um }];
}

/** Where the correction itself stands. @param {any} axis
 * @returns {"at_limit" | "at_soft_limit" | "within"} */
function judged(axis) {
  const um = Math.abs(axis.correction_um ?? 0);
  if (axis.limits && um >= axis.limits.largest_um - NEAR_LIMIT_UM) return "at_limit";
  return axis.at_soft_limit ? "at_soft_limit" : "within";
}

/** What is said of it: first that the model asks for more than is allowed. @param {any} axis */
function judgedWords(axis) {
  const values = { limit: number(axis.limits?.largest_um, 0) };
  if (axis.at_limit) return word("operator-over_limit", values);
  return { at_limit: word("operator-at_limit", values), within: "",
    at_soft_limit: word("operator-at_soft_limit", values) }[judged(axis)];
}

// ---- cards -----------------------------------------------------------------------------------

/** @param {Status} status @param {number} sinceS time since it was made @param {boolean} live */
export function showAxes(status, sinceS, live) {
  const box = byId("cards");
  const names = Object.keys(status.outputs);
  const shown = names.slice(0, MOST_CARDS);
  if (box.dataset.names !== JSON.stringify(shown)) {
    box.dataset.names = JSON.stringify(shown);
    box.dataset.count = String(shown.length);
    box.replaceChildren(...shown.map(card));
  }
  const more = byId("cards-more");
  more.hidden = names.length <= MOST_CARDS;
  say(more, moreSaid(status, names.slice(MOST_CARDS)));
  shown.forEach((name, k) => {
    const acting = actingOf(status.outputs[name], sinceS, live);
    fillCard(/** @type {HTMLElement} */ (box.children[k]), status, name, acting);
  });
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
  const found = /** @type {HTMLButtonElement} */ (made("button", "", "op-card",
    made("b", "", "op-card-name", made("span", shortNames(name)), made("small", "µm")),
    made("span", "", "op-value op-fit", made("b", "–")),
    made("span", "", "op-lines"),
    made("span", "", "op-shares")));
  found.type = "button";
  found.setAttribute("aria-haspopup", "dialog");
  return found;
}

/** @param {HTMLElement} element @param {Status} status @param {string} name
 * @param {ReturnType<typeof actingOf>} acting */
function fillCard(element, status, name, acting) {
  const axis = status.outputs[name];
  const number_ = /** @type {HTMLElement} */ (element.querySelector(".op-value b"));
  element.dataset.judged = judged(axis);
  element.dataset.known = acting.known ? "yes" : "no";
  if (number_.textContent !== acting.big) {
    say(number_, acting.big);
    fit(number_);
  }
  fillRows(element.querySelector(".op-lines"), [
    ["acting", "", acting.said || judgedWords(axis) || weightSaid(axis.weight, false)
      || word("operator-acts_now")],
    ["commanded", word("operator-commanded"), signed(commandedUm(axis), 1)],
    ["wanted", word("operator-wanted"), signed(wantedUm(status, axis), 1)],
  ]);
  const count = Number(element.parentElement?.dataset.count);
  const most = MOST_SOURCES[Math.min(count, MOST_SOURCES.length - 1)] ?? 0;
  fillShares(element.querySelector(".op-shares"), sharesOf(status, name, most));
}

/** Bars that begin where the one before ends: the last one ends at the correction.
 * @param {Element | null} box @param {Share[]} shares */
function fillShares(box, shares) {
  if (!box) return;
  if (box.childElementCount !== shares.length) {
    box.replaceChildren(...shares.map(() => made("span", "", "op-share", made("span"), made("span", "", "op-kelvin"),
      made("span", "", "op-bar", made("i"), made("i", "", "op-zero")), made("b"))));
  }
  let end = 0;
  const ends = shares.map(({ key, um }) => (key === "sum" ? um ?? 0 : end += um ?? 0));
  const [low, high] = [Math.min(0, ...ends), Math.max(0, ...ends)];
  const span = Math.max(LEAST_SPAN_UM, high - low);
  const start = (low + high - span) / 2;
  /** @param {number} um */
  const at = (um) => 100 * (um - start) / span;
  shares.forEach((one, k) => {
    const row = /** @type {HTMLElement} */ (box.children[k]);
    const [name, kelvin, bar, um] = [...row.children];
    row.dataset.row = one.key;
    say(name, one.name);
    say(kelvin, one.k);
    say(um, signed(one.um, 1));
    const long = one.um ?? 0;
    const from = (ends[k] ?? 0) - long;
    const [fill, zero] = /** @type {HTMLElement[]} */ ([...bar?.children ?? []]);
    if (!fill || !zero) return;
    fill.style.left = `${at(Math.min(from, from + long))}%`;
    fill.style.width = `${100 * Math.abs(long) / span}%`;
    zero.style.left = `${at(0)}%`;
  });
}

/** @param {number | null} weight @param {boolean} full whether that of a model is told that counts
 * wholly */
function weightSaid(weight, full) {
  if (weight === null) return full ? number(null, 0) : "";
  const values = { weight: number(100 * weight, 0) };
  if (weight >= 1) return full ? word("operator-weight_full", values) : "";
  return word("operator-weight_less", values);
}

// ---- all of it -------------------------------------------------------------------------------

/** @param {Element | null} lines @param {[string, string, string][]} rows key, label and value */
function fillRows(lines, rows) {
  if (!lines) return;
  if (lines.childElementCount !== rows.length) {
    lines.replaceChildren(...rows.map(([key, label]) => {
      const line = made("span", "", "op-line", made("span", label, "op-label"),
        made("span", "", "op-said"));
      line.dataset.row = key;
      return line;
    }));
  }
  rows.forEach(([, , value], k) => { say(lines.children[k]?.lastElementChild, value); });
}

/** @param {Status} status @param {string} name @returns {[string, string, string][]} */
function rowsOf(status, name) {
  const axis = status.outputs[name];
  const limits = axis.limits;
  /** @param {number | null} um */
  const um = (um) => `${signed(um, 1)}\u00a0µm`;
  const values = { owner: axis.trim_owner || "–", left: duration(axis.trim_left_s) };
  /** @param {string} what @returns {string} with its age, where that is told */
  const read = (what) => {
    const [value, ageS] = [um(axis[`${what}_um`]), axis[`${what}_age_s`] ?? null];
    return ageS === null ? value : word("operator-aged", { value, age: duration(ageS) });
  };
  return [
    ["commanded", word("operator-commanded"), um(commandedUm(axis))],
    ["accepted", word("operator-accepted"), read("accepted")],
    ["effective", word("operator-effective"), read("effective")],
    ["wanted", word("operator-wanted_full"), um(wantedUm(status, axis))],
    ["model", word("operator-model_asks"), um(modelAsksUm(axis))],
    ["trim", word("operator-trim"), isTrimmed(axis)
      ? `${um(axis.trim_um)}, ${word("operator-trim_by", values)}` : word("operator-trim_none")],
    ...isTouched(axis) ? touchRows(name, axis) : [],
    ["rate", word("operator-rate"), `${signed(axis.rate_um_per_s, 2)}\u00a0µm/s${limits
      ? `, ${word("operator-rate_of", { limit: number(limits.largest_rate_um_per_s, 2) })}` : ""}`],
    ["weight", word("operator-weight"), weightSaid(axis.weight, true)],
    ["limits", word("operator-limits"), limits ? word("operator-limits_of", {
      soft: number(limits.soft_um, 0), hard: number(limits.largest_um, 0) }) : "–"],
    ["parts", word("operator-parts"), sharesOf(status, name, Infinity)
      .map((one) => `${one.name} ${one.k} ${um(one.um)}${gainSaid(status, name, one.part ?? "")}`)
      .join(" · ")],
  ];
}

/** What touches add, what they show, and what became of the last one.
 * @param {string} name @param {any} axis @returns {[string, string, string][]} */
function touchRows(name, axis) {
  const std = number(axis.offset_std_um, 1);
  const why = axis.offset_void ? word("operator-touches_off") : axis.offset_acts ? ""
    : word(facts.touched[name]?.acts ? "operator-touches_unproven" : "operator-touches_only_shown");
  return [
    ["offset", word("operator-touches"), [`${signed(axis.offset_um, 1)}\u00a0µm`,
      word("operator-touch_known", { known: signed(axis.offset_known_um, 1), std }),
      ...why ? [why] : []].join("; ")],
    ["touch", word("operator-touch_last"), axis.touch_time ? word("operator-touch_showed", {
      time: timeOf(axis.touch_time), value: signed(axis.touch_um, 1), outcome: axis.touch_said,
    }) : word("operator-touch_none")],
  ];
}

/** What became of the last touch, in few words. @param {any} axis */
function outcomeSaid(axis) {
  if (axis.offset_void) return word("operator-touch_off");
  return {
    "": word("operator-touch_none"), believed: word("operator-touch_renewed"),
    confirmed: word("operator-touch_renewed"), excluded: word("operator-touch_again"),
  }[/** @type {string} */ (axis.touch_outcome)] ?? word("operator-touch_unused");
}

/** When was touched last and how that ended, and whether that is well and nothing is asked for: of
 * the axis that asks for one, else of the one that was touched last; null where none are looked at.
 * None is asked for where it could not be used, as the machine is not read.
 * @param {Status} status @returns {[boolean, string] | null} */
export function touchesSaid(status) {
  const [first] = Object.entries(status.outputs).filter(([, axis]) => isTouched(axis))
    .sort(([, a], [, b]) => Number(b.touch_now ?? false) - Number(a.touch_now ?? false)
      || Date.parse(b.touch_time ?? 0) - Date.parse(a.touch_time ?? 0));
  if (!first) return null;
  const [name, axis] = first;
  const now = axis.touch_now && status.source_connected && axis.acting_known;
  const values = { axis: shortNames(name), std: number(axis.offset_std_um, 1),
    time: axis.touch_time ? timeOf(axis.touch_time) : "", outcome: outcomeSaid(axis) };
  return [!now && !axis.offset_void && WELL.includes(axis.touch_outcome),
    word(now ? "operator-touch_now" : "operator-touched", values)];
}

/** @param {Status} status @param {string} output @param {string} part */
function gainSaid(status, output, part) {
  const gain = gainNow(status, output, part);
  const diameter = diameterWord(status.diameter_mm);
  return gain === null ? ""
    : ` (${word("operator-part_gain", { gain: number(gain, 2), diameter })})`;
}

/** @param {HTMLElement} body @param {Status} status */
export function fillDetails(body, status) {
  const names = Object.keys(status.outputs);
  if (body.dataset.names !== JSON.stringify(names)) {
    body.dataset.names = JSON.stringify(names);
    body.replaceChildren(made("p", word("operator-sign"), "op-quiet"),
      ...names.map((name) => made("section", "", "op-full", made("h3", shortNames(name)),
        made("p", "", "op-judged"), made("div", "", "op-lines"))));
  }
  names.forEach((name, k) => {
    const part = /** @type {HTMLElement} */ (body.children[k + 1]);
    say(part.querySelector(".op-judged"), judgedWords(status.outputs[name]));
    fillRows(part.querySelector(".op-lines"), rowsOf(status, name));
  });
}
