// @ts-check
/** What of a model moves with every status: contributions, inputs in their ranges, limits. */
import { made, say } from "../elements.js";
import { fillTable, panel, rangeBar, showRange, showVerdict, verdict, wide } from "./engineer.js";
import { inputOf } from "./parts.js";
import { number, shortNames, signed, word } from "../words.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */
/** @typedef {(show: (status: Data) => void) => void} Follow takes what is shown with every status */

// ---- contributions ---------------------------------------------------------------------------

/** @param {string} name @param {Follow} follow */
export function contributionsPanel(name, follow) {
  const [table, weight] = [made("table"), verdict()];
  let drawn = "";
  /** @type {HTMLElement[]} */
  let values = [];
  follow((status) => {
    const output = status.outputs[name];
    const parts = Object.keys(output?.parts_um ?? {});
    if (parts.join("\n") !== drawn) {
      drawn = parts.join("\n");
      values = parts.map(() => made("span", "–", "live"));
      fillTable(table, [word("model-part"), word("model-contribution")],
        parts.map((one, k) => [one, { number: values[k] ?? "" }]));
    }
    parts.forEach((one, k) => {
      if (values[k]) say(values[k], signed(output.parts_um[one], 1));
    });
    const found = output?.weight ?? null;
    showVerdict(weight, found === null ? null : found >= 1, weightWords(found));
  });
  return panel(word("model-contributions_title", { output: shortNames(name) }), wide(table), weight);
}

// ---- where it may be believed ----------------------------------------------------------------

/** @param {Data} output @param {Data} model @param {Follow} follow */
export function rangePanel(output, model, follow) {
  const table = made("table");
  const rows = output.parts.map((/** @type {Data} */ one) => {
    const [now, bar, said] = [made("span", "–", "live"), rangeBar(), verdict()];
    showRange(bar, { low: one.lowest_k, high: one.highest_k, value: null });
    follow((status) => {
      const value = inputNow(one, status.inputs);
      say(now, signed(value, 1));
      showRange(bar, { low: one.lowest_k, high: one.highest_k, value });
      showVerdict(said, insideOf(one, value), insideWords(one, value));
    });
    return [made("b", one.name), inputOf(one), { number: now }, bar, said];
  });
  fillTable(
    table,
    [
      word("model-part"),
      word("model-input"),
      word("model-input_now"),
      word("model-trained"),
      word("model-validity"),
    ],
    rows,
  );
  const weight = verdict();
  follow((status) => {
    const found = status.outputs[output.name]?.weight ?? null;
    showVerdict(weight, found === null ? null : found >= 1, weightWords(found));
  });
  const rule = word("model-validity_rule", {
    margin: number(model.margin_k, 1),
    lowest: `${number(100 * model.lowest_weight, 0)} %`,
  });
  const title = word("model-validity_title", { output: shortNames(output.name) });
  return panel(title, wide(table), weight, made("p", rule, "note"));
}

/**
 * Return a part's input relative to its reference, as the model takes it.
 * @param {Data} one
 * @param {Data} inputs
 * @returns {number | null}
 */
function inputNow(one, inputs) {
  const plus = aboveReference(inputs[one.plus]);
  if (!one.minus || plus === null) return plus;
  const minus = aboveReference(inputs[one.minus]);
  return minus === null ? null : plus - minus;
}

/** @param {Data | undefined} input @returns {number | null} */
function aboveReference(input) {
  const [value, reference] = [input?.value_c ?? null, input?.reference_c ?? null];
  return value === null || reference === null ? null : value - reference;
}

/** @param {Data} one @param {number | null} value @returns {boolean | null} */
function insideOf(one, value) {
  if (value === null || one.lowest_k === null) return null;
  return value >= one.lowest_k && value <= one.highest_k;
}

/** @param {Data} one @param {number | null} value */
function insideWords(one, value) {
  if (one.lowest_k === null) return word("model-range_unknown");
  const inside = insideOf(one, value);
  if (value === null || inside === null) return word("model-no_value");
  if (inside) return word("model-inside");
  const distance = Math.max(one.lowest_k - value, value - one.highest_k);
  return word("model-outside", { distance: number(distance, 1) });
}

/** @param {number | null} weight */
function weightWords(weight) {
  if (weight === null) return word("model-weight_unknown");
  if (weight >= 1) return word("model-weight_full");
  if (weight <= 0) return word("model-weight_none");
  return word("model-weight_part", { weight: number(100 * weight, 0) });
}

// ---- limits ----------------------------------------------------------------------------------

/** @param {Data} output @param {Follow} follow */
export function limitsPanel(output, follow) {
  const table = made("table");
  const rows = [
    ["largest_um", word("model-limit_largest"), "µm", 1],
    ["soft_um", word("model-limit_soft"), "µm", 1],
    ["total_um", word("model-limit_total"), "µm", 1],
    ["largest_rate_um_per_s", word("model-limit_rate"), "µm/s", 3],
    ["deadband_um", word("model-limit_deadband"), "µm", 2],
    ["largest_trim_um", word("model-limit_trim"), "µm", 1],
  ];
  const cells = rows.map(([key, name, unit, digits]) => {
    const value = made("span", "–", "live");
    follow((status) => {
      const found = status.outputs[output.name]?.limits?.[String(key)] ?? null;
      say(value, number(found, Number(digits)));
    });
    return [String(name), { number: value }, String(unit)];
  });
  fillTable(table, [word("model-limit"), word("model-value"), word("model-unit")], cells);
  return panel(word("model-limits_title", { output: shortNames(output.name) }), wide(table));
}
