// @ts-check
// Names of series, which are the columns of the history, in words and in groups.

import { shortNames, word } from "../words.js";

/** @type {Record<string, string>} */
const QUANTITIES = {
  correction: word("history-correction"),
  wanted: word("history-wanted"),
  model: word("history-model"),
  weight: word("history-weight"),
  trim: word("history-trim"),
  commanded: word("history-commanded"),
  accepted: word("history-accepted"),
  effective: word("history-effective"),
};

/** What the loop records beside inputs and outputs. @type {Record<string, string>} */
const OF_THE_LOOP = {
  active: word("history-active"),
  lateness_s: word("history-lateness"),
  diameter_mm: word("history-diameter"),
  other_compensation: word("history-other_compensation"),
};
const INTERLOCK = "interlock_";
const PROBE = "probe_";
/** What the model was given, beside what was read. */
const USED = /_used(_[A-Za-z]+)?$/;

const QUANTITY = new RegExp(`^(.+)_(${Object.keys(QUANTITIES).join("|")})(_um)?$`);
const CORRECTION = /^(.+)_correction(_um)?$/;
const OF_A_PART = /^(.+?)_part_(.+?)(_um)?$/;

/**
 * The short name of an output, and the quantity or the part of it that a column has.
 * @param {string} name
 */
function quantityOf(name) {
  const found = QUANTITY.exec(name);
  if (found) return { output: found[1], said: QUANTITIES[found[2]] };
  const part = OF_A_PART.exec(name);
  return part && { output: part[1], said: word("history-part", { name: part[2] }) };
}

/**
 * A series' name in words, outputs and inputs by the names that every page shows.
 * @param {string} name
 */
export function labelOf(name) {
  const own = OF_THE_LOOP[name];
  if (own) return own;
  if (name.startsWith(INTERLOCK)) {
    return word("history-interlock", { name: name.slice(INTERLOCK.length) });
  }
  if (name.startsWith(PROBE)) {
    return `${shortNames(name.slice(PROBE.length))} ${word("history-probe")}`;
  }
  const found = quantityOf(name);
  return found ? `${found.output} ${found.said}` : shortNames(name);
}

/**
 * Series in groups: each output, then inputs, then what the loop records of itself and the
 * workpiece, then the rest.
 * @param {Record<string, string>} units by name
 * @returns {[string, string[]][]}
 */
export function bySeries(units) {
  const names = Object.keys(units).filter((name) => !USED.test(name));
  const corrections = names.filter((name) => CORRECTION.test(name));
  const outputs = corrections.map((name) => shortNames(name.replace(CORRECTION, "$1")));
  /** @type {Map<string, string[]>} */
  const groups = new Map(outputs.map((output) => [output, []]));
  const inputs = word("history-group_inputs");
  const others = word("history-group_others");
  const loop = word("history-group_loop");
  groups.set(inputs, []);
  groups.set(loop, []);
  groups.set(others, []);
  for (const name of names) {
    const whole = name.startsWith(PROBE) ? name.slice(PROBE.length) : quantityOf(name)?.output;
    const output = outputs.find((one) => one === shortNames(whole ?? ""));
    const own = name in OF_THE_LOOP || name.startsWith(INTERLOCK);
    const plain = units[name] !== "" && units[name] !== "µm" && units[name] !== "s";
    groups.get(output ?? (own ? loop : plain ? inputs : others))?.push(name);
  }
  return [...groups].filter(([, some]) => some.length > 0);
}
