// @ts-check
// The inputs with value, quality and age: as many as there is room for, those that are not good
// first, and all of them in a dialog.

import { byId, made, say } from "../elements.js";
import { latest } from "../live.js";
import { duration, number, shortNames, word } from "../words.js";

/** @typedef {Record<string, any>} Status */

const FEW = 6;
const GOOD = "good";
const REDUNDANT = "redundant";

/** @param {Status} status */
export function showInputs(status) {
  const list = byId("inputs");
  const more = byId("inputs-more");
  const names = Object.keys(status.inputs);
  const bad = names.filter((name) => status.inputs[name].quality !== GOOD);
  const told = byId("inputs-told");
  const old = latest() === null;
  const said = bad.length
    ? word("operator-inputs_bad", { bad: bad.length, count: names.length })
    : word("operator-inputs_good", { count: names.length });
  told.dataset.bad = bad.length && !old ? "yes" : "no";
  say(told, old ? word("operator-inputs_old", { said }) : said);
  more.hidden = true;
  list.dataset.few = names.length <= FEW ? "yes" : "no";
  fillInputs(list, status, names);
  if (!tooHigh(list)) return;
  more.hidden = false;
  const good = names.filter((name) => !bad.includes(name));
  const ranked = [...bad, ...good];
  const items = /** @type {HTMLElement[]} */ ([...list.children]);
  const rows = new Map(names.map((name, k) => [name, items[k]]));
  for (let most = ranked.length - 1; most > 0 && tooHigh(list); most -= 1) {
    const last = rows.get(ranked[most] ?? "");
    if (last) last.hidden = true;
    say(more, word("operator-more_inputs", { count: ranked.length - most }));
  }
}

/** @param {HTMLElement} list */
function tooHigh(list) {
  return list.scrollHeight > list.clientHeight + 1;
}

/** @param {HTMLElement} list @param {Status} status @param {string[]} names */
export function fillInputs(list, status, names) {
  if (list.dataset.names !== JSON.stringify(names)) {
    list.dataset.names = JSON.stringify(names);
    list.replaceChildren(...names.map((name) => {
      const row = made("li", "", "op-input");
      row.append(
        made("span", "", "op-shape"),
        made("span", shortNames(name), "op-input-name"),
        made("b", "", "op-input-value"),
        made("span", "", "op-input-quality"),
        made("span", "", "op-input-age"),
      );
      return row;
    }));
  }
  names.forEach((name, k) => {
    fillInput(/** @type {HTMLElement} */ (list.children[k]), status.inputs[name]);
  });
}

/** @param {HTMLElement} row @param {Record<string, any>} input */
function fillInput(row, input) {
  const [shape, , value, quality, age] = [...row.children];
  row.hidden = false;
  const usable = input.quality === GOOD ? "good" : input.quality === REDUNDANT && "redundant";
  row.dataset.quality = usable || "bad";
  const old = latest() === null;
  say(shape, old ? "?" : { good: "✓", redundant: "3", bad: "2" }[row.dataset.quality] ?? "");
  shape?.setAttribute("aria-hidden", "true");
  say(value, `${number(input.value_c, 1)}\u00a0°C`);
  const judged = input.quality_said;
  say(quality, old ? `(${judged})` : judged);
  say(age, duration(old ? null : input.age_s));
}
