// @ts-check
// What the evaluation of a run says, as parts of the page.

import { inEnglish, made } from "../elements.js";
import { moment, number, signed, word } from "../words.js";

/** @typedef {Record<string, any>} Result */

const SYMBOLS = {
  B: "B", B_mean: "B̄", M: "M", E_forward: "E↑", E_backward: "E↓", E: "E",
  R_forward: "R↑", R_backward: "R↓", R: "R", A_forward: "A↑", A_backward: "A↓", A: "A",
  U_max: "Umax", U_mean: "Ū", Ps_max: "Ps max", Ps_mean: "P̄s", Pa: "Pa", P: "P",
};
const FIGURES = {
  B: "positioning-figure_b", B_mean: "positioning-figure_b_mean", M: "positioning-figure_m",
  E_forward: "positioning-figure_e_forward", E_backward: "positioning-figure_e_backward",
  E: "positioning-figure_e", R_forward: "positioning-figure_r_forward",
  R_backward: "positioning-figure_r_backward", R: "positioning-figure_r",
  A_forward: "positioning-figure_a_forward", A_backward: "positioning-figure_a_backward",
  A: "positioning-figure_a",
};
const CYCLES = {
  standard: "positioning-cycle_standard",
  pilgrim: "positioning-cycle_pilgrim",
  step: "positioning-cycle_step",
};
const DECISIONS = {
  pass: ["✓", "positioning-passed"],
  fail: ["✗", "positioning-failed"],
  "not decided": ["?", "positioning-not_decided"],
};
const RULES = {
  simple: "positioning-rule_simple",
  "iso14253-1": "positioning-rule_iso14253",
};
const MODELS = {
  none: "positioning-drift_none",
  line: "positioning-drift_line",
  smooth: "positioning-drift_smooth",
};
const OTHERS = { iso230_2_1988: "ISO 230-2:1988", vdi3441: "VDI/DGQ 3441" };
const UNITS = {
  linear: { deviation: "µm", target: "mm", growth: "µm/m" },
  rotary: { deviation: "″", target: "°", growth: "″/1000°" },
};

/**
 * @template T
 * @param {Record<string, T>} table
 * @param {string} key
 * @returns {T | undefined}
 */
function known(table, key) {
  return Object.hasOwn(table, key) ? table[key] : undefined;
}

/** @param {(number | null)[]} values */
function decimals(values) {
  const sizes = values.filter((value) => value !== null).map((value) => Math.abs(Number(value)));
  const largest = Math.max(0, ...sizes);
  if (largest >= 1) return 2;
  return largest >= 0.1 ? 3 : 4;
}

/**
 * An uncertainty with two significant digits.
 * @param {number | null} value
 */
function within(value) {
  return number(value, twoDigits(value));
}

/**
 * Decimals that show two significant digits of a number.
 * @param {number | null} value
 */
function twoDigits(value) {
  if (!value) return 1;
  const rounded = Math.abs(Number(value.toPrecision(2)));
  return Math.min(6, Math.max(0, 1 - Math.floor(Math.log10(rounded))));
}

/** @param {string | null} verdict */
function decision(verdict) {
  const found = known(DECISIONS, verdict ?? "");
  if (!found) return made("span");
  const mark = made("span", `${found[0]} ${word(found[1])}`, "run-decision");
  mark.dataset.verdict = verdict ?? "";
  return mark;
}

/** @param {Result} result */
function figureTable(result) {
  const rows = /** @type {Result[]} */ (result.figures);
  const hasWithin = rows.some((row) => row.measured_within !== null);
  const hasDrift = result.drift !== null;
  const hasLimits = result.verdict !== null;
  const digits = decimals(rows.map((row) => row.measured));
  const unit = unitsOf(result).deviation;
  const columns = [
    `${word("positioning-measured")}, ${unit}`,
    ...(hasWithin ? [word("positioning-within")] : []),
    ...(hasDrift ? [`${word("positioning-drift_free")}, ${unit}`] : []),
    ...(hasDrift && hasWithin ? [word("positioning-within")] : []),
    ...(hasLimits ? [word("positioning-limit")] : []),
  ];
  const head = [heading(word("positioning-figure")), ...columns.map((one) => heading(one, "number"))];
  if (hasLimits) head.push(heading(word("positioning-decision")));
  return table(head, rows.map((row) => {
    const name = /** @type {HTMLTableCellElement} */ (made("th"));
    name.scope = "row";
    name.append(made("span", known(SYMBOLS, row.key) ?? row.key, "run-symbol"),
      ` ${word(known(FIGURES, row.key) ?? "")}`);
    const exact = (/** @type {number | null} */ value, /** @type {number | null} */ band) =>
      figure(number(value, band ? twoDigits(band) : digits), value);
    const bandOf = (/** @type {number | null} */ band) => figure(within(band), band);
    const cells = [
      exact(row.measured, row.measured_within),
      ...(hasWithin ? [bandOf(row.measured_within)] : []),
      ...(hasDrift ? [exact(row.drift_free, row.drift_free_within)] : []),
      ...(hasDrift && hasWithin ? [bandOf(row.drift_free_within)] : []),
      ...(hasLimits ? [figure(number(row.limit, digits), row.limit)] : []),
    ];
    const judged = hasLimits ? [made("td", "", "", decision(row.verdict))] : [];
    return [name, ...cells, ...judged];
  }));
}

/** A number as it is shown, with all of its digits behind it. @param {string} text @param {number | null} value */
function figure(text, value) {
  const cell = made("td", text, "number");
  if (value !== null) cell.dataset.value = cell.title = String(value);
  return cell;
}

/**
 * @param {string} text
 * @param {string} [kind]
 */
function heading(text, kind = "") {
  const cell = /** @type {HTMLTableCellElement} */ (made("th", text, kind));
  cell.scope = "col";
  return cell;
}

/**
 * @param {HTMLElement[]} head
 * @param {HTMLElement[][]} rows
 */
function table(head, rows) {
  const rowOf = (/** @type {HTMLElement[]} */ cells) => made("tr", "", "", ...cells);
  const scroll = made("div", "", "run-scroll", made("table", "", "",
    made("thead", "", "", rowOf(head)), made("tbody", "", "", ...rows.map(rowOf))));
  scroll.tabIndex = 0;
  scroll.setAttribute("role", "region");
  scroll.setAttribute("aria-label", word("positioning-figures"));
  return scroll;
}

/** @param {Result} result */
function unitsOf(result) {
  return known(UNITS, result.kind) ?? UNITS.linear;
}

/** @param {Result} result */
function notes(result) {
  const lines = [
    ...(result.drift ? [word("positioning-not_the_standard")] : []),
    ...(result.figures.some((/** @type {Result} */ row) => row.measured === null)
      ? [word("positioning-absent")] : []),
    ...(result.left_out.length > 0
      ? [word("positioning-uncertainty_without", { terms: result.left_out.join("; ") })] : []),
  ];
  return made("div", "", "muted", ...lines.map((text) => made("p", text)));
}

/** @param {Result} result */
function verdict(result) {
  if (result.verdict === null) return [];
  const line = made("p", word("positioning-verdict"), "run-verdict", decision(result.verdict));
  const rule = known(RULES, result.decision_rule);
  return rule ? [line, made("p", word(rule), "muted")] : [line];
}

/** @param {Result} result */
function drift(result) {
  const found = result.drift;
  if (!found) return [];
  const units = unitsOf(result);
  const lines = [word(known(MODELS, found.model) ?? "positioning-drift_smooth")];
  if (found.model !== "none") {
    lines.push(word("positioning-drift_total", {
      total: signed(found.total, twoDigits(found.total_within)),
      within: within(found.total_within), unit: units.deviation,
      per_m: signed(found.total_per_m, twoDigits(found.total_per_m_within)),
      per_m_within: within(found.total_per_m_within), unit_per: units.growth,
    }));
    const hours = number(found.reference_time_s / 3600, 2);
    lines.push(word("positioning-drift_state", { hours }));
  }
  return section(word("positioning-drift_title"), lines.map((text) => made("p", text)));
}

/** @param {Result} result */
function anomalies(result) {
  const unit = unitsOf(result).target;
  const rows = result.anomalies.map((/** @type {Result} */ one) => made("li", word(
    "positioning-anomaly",
    {
      approach: one.approach === "forward" ? "↑" : "↓", position: one.position,
      target: number(one.target, 3), unit, ratio: number(one.statistic, 2),
    },
  )));
  return listed(word("positioning-anomalies"), rows);
}

/** @param {Result} result */
function other(result) {
  if (!result.other) return [];
  const head = [heading(word("positioning-figure")),
    heading(`${word("positioning-measured")}, ${unitsOf(result).deviation}`, "number")];
  const entries = /** @type {[string, number][]} */ (Object.entries(result.other.figures));
  const digits = decimals(entries.map(([, value]) => value));
  const rows = entries.map(([key, value]) => [
    made("td", known(SYMBOLS, key) ?? key, "run-symbol"),
    made("td", number(value, digits), "number"),
  ]);
  const name = known(OTHERS, result.other.name) ?? "";
  return section(word("positioning-other", { name }), [
    table(head, rows), inEnglish("p", result.other.mark),
  ]);
}

/**
 * @param {string} title
 * @param {HTMLElement[]} content
 */
function section(title, content) {
  return [made("section", "", "", made("h3", title), ...content)];
}

/**
 * @param {string} title
 * @param {HTMLElement[]} rows
 */
function listed(title, rows) {
  if (rows.length === 0) return [];
  return section(title, [made("ul", "", "", ...rows)]);
}

/**
 * The figures of several runs, one run in a row.
 * @param {Result} trend
 */
export function trendOf(trend) {
  const keys = ["B", "E", "R", "A"];
  const { deviation } = known(UNITS, trend.kind) ?? UNITS.linear;
  const head = [heading(word("positioning-trend_run")), heading(word("positioning-trend_begun")),
    ...keys.flatMap((key) => [heading(`${key}, ${deviation}`, "number"),
      heading(word("positioning-within"), "number")])];
  const rows = trend.runs.map((/** @type {Result} */ run) => [
    made("td", run.name), made("td", moment(run.start)),
    ...keys.flatMap((key) => [
      made("td", number(run.iso230_2[key], twoDigits(run.uncertainty[key])), "number"),
      made("td", within(run.uncertainty[key]), "number")]),
  ]);
  const remarks = trend.warnings.map((/** @type {string} */ one) => inEnglish("p", one));
  return [table(head, rows), ...remarks];
}

/** @param {Result} result */
export function facts(result) {
  const ways = word(result.unidirectional ? "positioning-one_way" : "positioning-both_ways");
  const cycle = known(CYCLES, result.cycle);
  return [
    ...(result.machine ? [result.machine] : []),
    ...(result.axis ? [word("positioning-axis", { axis: result.axis })] : []),
    word("positioning-runs", {
      targets: result.targets, cycles: result.cycles, cycle: cycle ? word(cycle) : result.cycle,
    }),
    ways,
    ...(result.start ? [word("positioning-begun", { time: moment(result.start) })] : []),
    `ISO 230-2:${result.edition}`,
  ].join(" · ");
}

/**
 * Everything below the name of the run.
 * @param {Result} result
 * @returns {HTMLElement[]}
 */
export function shownOf(result) {
  return [
    ...verdict(result),
    figureTable(result),
    notes(result),
    ...other(result),
    ...drift(result),
    ...anomalies(result),
    ...listed(word("positioning-diagnosis"),
      result.diagnosis.map((/** @type {string} */ text) => made("li", text))),
    ...listed(word("positioning-warnings"),
      result.warnings.map((/** @type {string} */ text) => inEnglish("li", text))),
    made("p", word("positioning-content", { sha256: result.sha256 }), "muted"),
  ];
}
