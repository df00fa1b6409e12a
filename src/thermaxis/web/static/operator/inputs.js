// @ts-check
// The inputs: how many are good and which are not in one line, all of them in a dialog.

import { byId, made, say } from "../elements.js";
import { latest } from "../live.js";
import { duration, number, shortNames, word } from "../words.js";

/** @typedef {Record<string, any>} Status */

const MOST_NAMES = 1;
const SHAPES = /** @type {Record<string, string>} */ ({ good: "✓", redundant: "3" });

/** @param {Status} status */
export function showInputs(status) {
  const names = Object.keys(status.inputs);
  const bad = names.filter((name) => status.inputs[name].quality !== "good");
  const named = bad.slice(0, MOST_NAMES).map(shortNames).join(", ");
  const values = { bad: bad.length, count: names.length,
    names: bad.length > MOST_NAMES ? `${named} …` : named };
  const said = bad.length
    ? `▲ ${word("operator-inputs_bad", values)}` : word("operator-inputs_good", values);
  const old = latest() === null;
  const open = byId("inputs-open");
  open.dataset.good = bad.length && !old ? "no" : "yes";
  say(open, old ? word("operator-inputs_old", { said }) : said);
}

/** @param {HTMLElement} body @param {Status} status */
export function fillInputs(body, status) {
  const names = Object.keys(status.inputs);
  if (body.dataset.names !== JSON.stringify(names)) {
    body.dataset.names = JSON.stringify(names);
    body.replaceChildren(made("ul", "", "op-rows", ...names.map((name) => made("li", "", "op-input",
      made("span", "", "op-shape"), made("span", shortNames(name), "op-input-name"),
      made("b", "", "op-input-value"), made("span", "", "op-input-quality"),
      made("span", "", "op-input-age")))));
  }
  const rows = /** @type {HTMLElement[]} */ ([...body.querySelectorAll(".op-input")]);
  names.forEach((name, k) => {
    const [row, input] = [rows[k], status.inputs[name]];
    if (row) fillInput(row, input);
  });
}

/** @param {HTMLElement} row @param {Record<string, any>} input */
function fillInput(row, input) {
  const [shape, , value, quality, age] = [...row.children];
  const old = latest() === null;
  row.dataset.quality = Object.hasOwn(SHAPES, input.quality) ? input.quality : "bad";
  say(shape, old ? "?" : SHAPES[input.quality] ?? "2");
  shape?.setAttribute("aria-hidden", "true");
  say(value, `${number(input.value_c, 1)}\u00a0°C`);
  say(quality, old ? `(${input.quality_said})` : input.quality_said);
  say(age, duration(old ? null : input.age_s));
}
