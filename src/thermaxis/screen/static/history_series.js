// @ts-check
// Names of series in words, and in groups.

import { word } from "./words.js";

/** @type {Record<string, string>} */
const QUANTITIES = {
  correction: word("history.correction"),
  wanted: word("history.wanted"),
  model: word("history.model"),
  weight: word("history.weight"),
  trim: word("history.trim"),
  before: word("history.before"),
  requested: word("history.requested"),
  accepted: word("history.accepted"),
  effective: word("history.effective"),
};

/**
 * A series' name in words; names of the machine stay as they are.
 * @param {string} name
 */
export function labelOf(name) {
  if (name === "active") return word("history.active");
  const [head, quantity, ...rest] = name.split(".");
  if (quantity === undefined) return name;
  if (head === "probe") return `${[quantity, ...rest].join(".")} ${word("history.probe")}`;
  const part = rest.join(".");
  if (quantity === "part" && part) return `${head} ${word("history.part", { name: part })}`;
  if (quantity === "gain" && part) return `${head} ${word("history.gain", { name: part })}`;
  const known = QUANTITIES[quantity];
  return known && !part ? `${head} ${known}` : name;
}

/**
 * Series in groups: each output, then inputs, then the rest.
 * @param {string[]} names
 * @returns {[string, string[]][]}
 */
export function bySeries(names) {
  const outputs = names
    .filter((name) => name.endsWith(".correction"))
    .map((name) => name.slice(0, -".correction".length));
  /** @type {Map<string, string[]>} */
  const groups = new Map(outputs.map((output) => [output, []]));
  const inputs = word("history.group_inputs");
  const others = word("history.group_others");
  groups.set(inputs, []);
  groups.set(others, []);
  for (const name of names) {
    const output = outputs.find((one) => name.startsWith(`${one}.`) || name === `probe.${one}`);
    const plain = /_[cC](\.spare)?$/.test(name) || !name.includes(".");
    groups.get(output ?? (plain ? inputs : others))?.push(name);
  }
  return [...groups].filter(([, some]) => some.length > 0);
}
