// @ts-check
// Names of series, which are the columns of the history, in words and in groups.

import { shortNames, word } from "../words.js";

const QUANTITIES = /** @type {Record<string, string>} */ ({
  correction: word("history-correction"),
  wanted: word("history-wanted"),
  model: word("history-model"),
  weight: word("history-weight"),
  at_limit: word("history-limited"),
  trim: word("history-trim"),
  commanded: word("history-commanded"),
  accepted: word("history-accepted"),
  effective: word("history-effective"),
});
const OF_THE_LOOP = /** @type {Record<string, string>} */ ({
  active: word("history-active"),
  lateness_s: word("history-lateness"),
  diameter_mm: word("history-diameter"),
  other_compensation: word("history-other_compensation"),
});
const LOOP = word("history-group_loop");
const NAMED = new RegExp(
  "^(?:interlock_(?<interlock>.+)|probe_(?<probe>.+?)(?:_um)?|(?<output>.+?)_"
  + `(?:part_(?<part>.+?)|(?<quantity>${Object.keys(QUANTITIES).join("|")}))(?:_um)?)$`,
);
// what the model was given, what was read of the diameter that counts, and a clock
const FOR_MACHINES = /_used(_[A-Za-z]+)?$|^(diameter|monotonic_s)$/;

/** The group of a series, and its name in words. @param {string} name @returns {[string, string]} */
function placeOf(name) {
  const { interlock, probe, output, part, quantity } = NAMED.exec(name)?.groups ?? {};
  if (OF_THE_LOOP[name]) return [LOOP, OF_THE_LOOP[name]];
  if (interlock) return [LOOP, word("history-interlock", { name: shortNames(interlock) })];
  if (probe) return [probe, `${probe} ${word("history-probe")}`];
  if (part) return [output, `${output} ${word("history-part", { name: shortNames(part) })}`];
  if (quantity) return [output, `${output} ${QUANTITIES[quantity]}`];
  const first = name.replace(/_redundant(?=_[A-Za-z]+$|$)/, "");
  return ["", shortNames(first) + (first === name ? "" : ` (${word("sensors-redundant")})`)];
}

/** A series' name as every page shows it. @param {string} name */
export function labelOf(name) {
  return placeOf(name)[1];
}

/**
 * Series in groups: each output, then inputs, then what the loop records of itself and the
 * workpiece, then the rest.
 * @param {Record<string, string>} units by name
 * @returns {[string, string[]][]}
 */
export function bySeries(units) {
  const names = Object.keys(units).filter((name) => !FOR_MACHINES.test(name));
  const corrections = names.filter((name) => /_correction(_um)?$/.test(name));
  const [inputs, others] = [word("history-group_inputs"), word("history-group_others")];
  const titles = [...corrections.map((name) => placeOf(name)[0]), inputs, LOOP, others];
  const groups = new Map(titles.map((title) => [title, /** @type {string[]} */ ([])]));
  for (const name of names) {
    const [group] = placeOf(name);
    const plain = units[name] !== "" && units[name] !== "µm" && units[name] !== "s";
    (groups.get(group) ?? groups.get(plain ? inputs : others))?.push(name);
  }
  return [...groups].filter(([, some]) => some.length > 0);
}
