// @ts-check
// Names of series in words, and in groups.

import { shortNames, word } from "../words.js";

/** @type {Record<string, string>} */
const QUANTITIES = {
  correction: word("history-correction"),
  wanted: word("history-wanted"),
  model: word("history-model"),
  weight: word("history-weight"),
  trim: word("history-trim"),
  before: word("history-before"),
  requested: word("history-requested"),
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
const INTERLOCK = "interlock.";

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
  const [whole, quantity, ...rest] = name.split(".");
  const head = shortNames(whole);
  if (quantity === undefined) return head;
  if (head === "probe") {
    return `${shortNames([quantity, ...rest].join("."))} ${word("history-probe")}`;
  }
  const part = rest.join(".");
  if (quantity === "part" && part) return `${head} ${word("history-part", { name: part })}`;
  if (quantity === "gain" && part) return `${head} ${word("history-gain", { name: part })}`;
  const known = QUANTITIES[quantity];
  return known && !part ? `${head} ${known}` : [head, quantity, ...rest].join(".");
}

/**
 * Series in groups: each output, then inputs, then what the loop records of itself and the
 * workpiece, then the rest.
 * @param {Record<string, string>} units by name
 * @returns {[string, string[]][]}
 */
export function bySeries(units) {
  const names = Object.keys(units);
  const outputs = names
    .filter((name) => name.endsWith(".correction"))
    .map((name) => name.slice(0, -".correction".length));
  /** @type {Map<string, string[]>} */
  const groups = new Map(outputs.map((output) => [output, []]));
  const inputs = word("history-group_inputs");
  const others = word("history-group_others");
  const loop = word("history-group_loop");
  groups.set(inputs, []);
  groups.set(loop, []);
  groups.set(others, []);
  for (const name of names) {
    const output = outputs.find((one) => name.startsWith(`${one}.`) || name === `probe.${one}`);
    const own = name in OF_THE_LOOP || name.startsWith(INTERLOCK);
    const plain = units[name] === "°C" || name.endsWith(".redundant") || !name.includes(".");
    groups.get(output ?? (own ? loop : plain ? inputs : others))?.push(name);
  }
  return [...groups].filter(([, some]) => some.length > 0);
}
