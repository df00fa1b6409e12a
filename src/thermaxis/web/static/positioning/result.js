// @ts-check
// What the evaluation of a run says, as parts of the page.

import { inEnglish, made } from "../elements.js";
import { listed, numberCell, section, tableOf, titleCell } from "../room.js";
import { duration, exactly, number, signed, word } from "../words.js";

/** @typedef {Record<string, any>} Result the JSON that the command prints */

const SYMBOLS = /** @type {Record<string, string>} */ ({
  B_mean: "B̄", U_max: "Umax", U_mean: "Ū", Ps_max: "Ps max", Ps_mean: "P̄s",
});
const DECISIONS = /** @type {Record<string, string[]>} */ ({
  pass: ["✓", "positioning-passed"],
  fail: ["✗", "positioning-failed"],
  "not decided": ["?", "positioning-not_decided"],
});
const OTHERS = { iso230_2_1988: "ISO 230-2:1988", vdi3441: "VDI/DGQ 3441" };
const LINEAR = { deviation: "µm", target: "mm", growth: "µm/m" };
const ROTARY = { deviation: "″", target: "°", growth: "″/1000°" };

/** @param {string} kind */
export const unitsOf = (kind) => kind === "rotary" ? ROTARY : LINEAR;

/** How a figure is written. @param {string} key */
export function symbolOf(key) {
  return SYMBOLS[key] ?? key.replace("_forward", "↑").replace("_backward", "↓");
}

/** @param {string} key */
const symbol = (key) => made("span", symbolOf(key), "run-symbol");

/** @param {(number | null)[]} values */
function decimals(values) {
  const largest = Math.max(0, ...values.map((value) => Math.abs(value ?? 0)));
  if (largest >= 1) return 2;
  return largest >= 0.1 ? 3 : 4;
}

/** Decimals that show two significant digits of a number. @param {number | null} value */
function twoDigits(value) {
  if (!value) return 1;
  const rounded = Math.abs(Number(value.toPrecision(2)));
  return Math.min(6, Math.max(0, 1 - Math.floor(Math.log10(rounded))));
}

/** An uncertainty with two significant digits. @param {number | null} value */
const within = (value) => number(value, twoDigits(value));

/** An amount as the command says it: with its band, or what it is less than. @param {number} value @param {number} band */
function amount(value, band) {
  if (band > 0 && Math.abs(value) <= band) {
    return word("positioning-less_than", { limit: within(Math.abs(value) + band) });
  }
  return `${signed(value, twoDigits(band))} ± ${within(band)}`;
}

/** @param {string | null} verdict */
function decision(verdict) {
  const [sign, key] = DECISIONS[verdict ?? ""] ?? [];
  const mark = made("span", key ? `${sign} ${word(key)}` : "", key ? "run-decision" : "");
  mark.dataset.verdict = verdict ?? "";
  return mark;
}

/** @param {Result} result */
function figureTable({ figure_table: rows, drift, limits, test }) {
  const hasWithin = rows.some((/** @type {Result} */ row) => row.expanded_uncertainty !== null);
  const digits = decimals(rows.map((/** @type {Result} */ row) => row.value));
  const unit = unitsOf(test.kind).deviation;
  const pair = (/** @type {string} */ key) =>
    [`${word(key)}, ${unit}`, ...(hasWithin ? ["U"] : [])];
  const cells = (/** @type {number | null} */ value, /** @type {number | null} */ band) =>
    [numberCell(value, band ? twoDigits(band) : digits),
      ...(hasWithin ? [numberCell(band, twoDigits(band))] : [])];
  const head = [word("positioning-figure"), ...pair("positioning-measured"),
    ...(drift ? pair("positioning-drift_free") : []),
    ...(limits ? [word("positioning-limit"), word("positioning-decision")] : [])];
  return tableOf(word("positioning-figures"), head, rows.map((/** @type {Result} */ row) => [
    titleCell(symbol(row.figure), ` ${word(`positioning-figure_${row.figure.toLowerCase()}`)}`),
    ...cells(row.value, row.expanded_uncertainty),
    ...(drift ? cells(row.drift_free, row.drift_free_expanded_uncertainty) : []),
    ...(limits ? [numberCell(row.limit, digits), made("td", "", "", decision(row.verdict))] : []),
  ]));
}

/** @param {Result} result */
function notes({ drift, figure_table: rows, uncertainty }) {
  const without = uncertainty?.measured?.left_out ?? [];
  const doubts = uncertainty?.may_be_too_small ?? [];
  const factors = rows.flatMap((/** @type {Result} */ row) =>
    [row.coverage_factor, row.drift_free_coverage_factor].filter(Boolean));
  const lines = [
    ...(doubts.length ? [word("positioning-coverage_doubted", { doubts: doubts.join("; ") })]
      : factors.length ? [word("positioning-coverage", {
        low: number(Math.min(...factors), 2), high: number(Math.max(...factors), 2) })] : []),
    ...(drift ? [word("positioning-not_the_standard")] : []),
    ...(rows.some((/** @type {Result} */ row) => row.value === null)
      ? [word("positioning-absent")] : []),
    ...(without.length
      ? [word("positioning-uncertainty_without", { terms: without.join("; ") })] : []),
  ];
  return made("div", "", "muted", ...lines.map((text) => made("p", text)));
}

/** @param {Result} result */
function verdict({ limits }) {
  if (!limits) return [];
  const rule = word(`positioning-rule_${limits.decision_rule.split("-")[0]}`);
  return [made("p", word("positioning-verdict"), "run-verdict", decision(limits.verdict)),
    made("p", rule, "muted")];
}

/** What the axis travelled, in its unit. @param {Result} test */
const spanOf = ({ targets }) => Math.max(...targets) - Math.min(...targets);

/** @param {Result} result */
function driftOf({ drift: found, test }) {
  if (!found) return [];
  const units = unitsOf(test.kind);
  const model = ["none", "line"].includes(found.model) ? found.model : "smooth";
  const p = found.p_no_drift < 1e-4 ? `p < ${number(1e-4, 4)}`
    : `p = ${number(found.p_no_drift, twoDigits(found.p_no_drift))}`;
  const lines = [word(`positioning-drift_${model}`, { p })];
  if (model !== "none") {
    const length = spanOf(test);
    lines.push(word("positioning-drift_total", {
      shift: amount(found.total, found.total_within), unit: units.deviation,
      growth: amount(found.total_per_m, found.total_per_m_within), unit_per: units.growth,
      grown: amount(found.total_per_m * length / 1e3, found.total_per_m_within * length / 1e3),
      length: number(length, 1), unit_length: units.target,
    }), word("positioning-drift_state", { hours: number(found.reference_time_s / 3600, 2) }));
  }
  return section(word("positioning-drift_title"), ...lines.map((text) => made("p", text)));
}

/** @param {Result} result */
function anomalies({ adjacent_difference: found, test }) {
  const unit = unitsOf(test.kind).target;
  return listed(word("positioning-anomalies"), ["forward", "backward"].flatMap((approach) =>
    (found?.[approach]?.anomalies ?? []).map((/** @type {Result} */ one) =>
      word("positioning-anomaly", {
        approach: approach === "forward" ? "↑" : "↓", position: one.position,
        target: number(one.position_mm, 3), unit, ratio: number(one.statistic, 2),
      }))));
}

/** Figures of the other standard, if one was asked for. @param {Result} result */
function other(result) {
  return Object.entries(OTHERS).filter(([key]) => result[key]).flatMap(([key, name]) => {
    const entries = /** @type {[string, number][]} */ (
      Object.entries(result[key]).filter(([, value]) => typeof value === "number"));
    const digits = decimals(entries.map(([, value]) => value));
    const measured = `${word("positioning-measured")}, ${unitsOf(result.test.kind).deviation}`;
    const title = word("positioning-other", { name });
    return section(title, tableOf(title, [word("positioning-figure"), measured],
      entries.map(([one, value]) => [titleCell(symbol(one)), numberCell(value, digits)])),
    inEnglish("p", result[key].mark ?? ""));
  });
}

/** A time that a file states, in the order that nobody doubts. @param {string} time */
const day = (time) => time.replace("T", " ").slice(0, 16);

/** The figures of several runs, one run in a row. @param {Result} trend */
export function trendOf(trend) {
  const keys = ["B", "E", "R", "A"];
  const { deviation } = unitsOf(trend.kind);
  const head = [word("positioning-trend_run"), word("positioning-trend_begun"),
    ...keys.flatMap((key) => [`${key}, ${deviation}`, word("positioning-within")])];
  const rows = trend.runs.map((/** @type {Result} */ run) => [
    titleCell(run.name), made("td", run.start ? day(run.start) : ""),
    ...keys.flatMap((key) => [numberCell(run.iso230_2[key], twoDigits(run.uncertainty[key])),
      numberCell(run.uncertainty[key], twoDigits(run.uncertainty[key]))]),
  ]);
  return [tableOf(word("positioning-trend_title"), head, rows),
    ...listed(word("positioning-warnings"), trend.warnings)];
}

/** @param {Result} result */
export function facts({ test, iso230_2 }) {
  const { axis, machine } = test.header;
  const { targets, start, end } = test;
  return [
    ...(machine ? [machine] : []),
    ...(axis ? [word("positioning-axis", { axis })] : []),
    word("positioning-runs", {
      targets: targets.length, cycles: test.cycles, unit: unitsOf(test.kind).target,
      first: exactly(Math.min(...targets)), last: exactly(Math.max(...targets)),
      cycle: word(`positioning-cycle_${test.cycle}`),
    }),
    word(test.unidirectional ? "positioning-one_way" : "positioning-both_ways"),
    ...(start ? [word("positioning-begun", { time: day(start) })] : []),
    ...(start && end ? [duration((Date.parse(end) - Date.parse(start)) / 1e3)] : []),
    `ISO 230-2:${iso230_2.edition}`,
  ].join(" · ");
}

/** Everything below the name of the run. @param {Result} result @returns {HTMLElement[]} */
export function shownOf(result) {
  const diagnosis = (result.drift?.diagnosis ?? []).map((/** @type {Result} */ one) => one.text);
  return [
    ...verdict(result),
    figureTable(result),
    notes(result),
    ...other(result),
    ...driftOf(result),
    ...anomalies(result),
    ...listed(word("positioning-diagnosis"), diagnosis),
    ...listed(word("positioning-warnings"), result.warnings),
    made("p", word("positioning-content", { sha256: result.input.sha256 }), "muted"),
  ];
}
