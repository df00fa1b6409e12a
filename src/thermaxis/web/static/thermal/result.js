// @ts-check
// What lies on the bench, each as a card: a log, a model, a verification, models compared.

import { drawChart } from "../chart/chart.js";
import { button, byId, made } from "../elements.js";
import {
  askedBy, download, inOwnWords, listed, numberCell, tableOf, titleCell, work,
} from "../room.js";
import { duration, word } from "../words.js";

/** @typedef {import("../room.js").Data} Data */
/** @typedef {(entry: Data) => Promise<void>} Remove */
/** @typedef {[string, number, (row: Data) => any]} Column its head, its decimals, its value */

const FIGURES = /** @type {Column[]} */ ([
  ["thermal-fit", 1, (row) => row.fit_percent],
  ["thermal-measured_range", 2, (row) => row.peak_to_peak_um?.uncompensated],
  ["thermal-left_range", 2, (row) => row.peak_to_peak_um?.residual],
]);
const IDENTIFIED = /** @type {Column[]} */ ([
  ...FIGURES,
  ["thermal-held_fit", 1, (row) => row.held_out?.fit_percent],
  ["thermal-held_rmse", 2, (row) => row.held_out?.rmse_um.model],
  ["thermal-held_static", 2, (row) => row.held_out?.rmse_um.static],
]);
const VERIFIED = /** @type {Column[]} */ ([
  ...FIGURES,
  ["thermal-reduction", 1, (row) => row.peak_to_peak_um?.reduction],
  ["thermal-rmse", 2, (row) => row.rmse_um],
  ["thermal-max", 2, (row) => row.max_um],
  ["thermal-static", 2, (row) => row.static_rmse_um],
]);
const PARTS = /** @type {Column[]} */ ([
  ["thermal-dc_gain", 2, (row) => row.dc_gain],
  ["thermal-direct_gain", 2, (row) => row.direct_gain],
  ["thermal-gains", 2, (row) => row.gains],
  ["thermal-time_constants", 0, (row) => row.time_constants_s],
  ["thermal-delay", 0, (row) => row.delay_s],
]);
const CHANNELS = /** @type {Column[]} */ ([
  ["thermal-rows", 0, (row) => row.rows],
  ["thermal-lowest", 2, (row) => row.lowest],
  ["thermal-highest", 2, (row) => row.highest],
]);
const LOOKS = /** @type {Record<string, Data>} */ ({
  measured: { color: 1, dash: "solid", marker: "circle" },
  simulated: { color: 2, dash: "dash", marker: "none" },
  residual: { color: 3, dash: "solid", marker: "square" },
});
const QUANTITIES = {
  temperature: "thermal-temperature", displacement: "thermal-displacement", "": "thermal-unitless",
};

/** @param {Data} entry @param {Data[]} entries all, for the names of what it is made of @param {Remove} onRemove */
export function cardOf(entry, entries, onRemove) {
  const names = entry.made_of.map((/** @type {string} */ key) =>
    entries.find(({ id }) => id === key)?.name ?? "");
  const [title, parts, files] = {
    log: logParts, model: modelParts, verification: verificationParts, comparison: comparisonParts,
  }[/** @type {"log"} */ (entry.kind)](entry, names);
  const heading = made("h2", title);
  heading.tabIndex = -1;
  const buttons = files.map((kind) => button(word(`thermal-take_${kind}`), () =>
    void download(`/thermal/${kind}/${entry.id}`)));
  const remove = button("✕", () => void onRemove(entry), word("thermal-remove", { name: title }));
  const card = made("section", "", "panel",
    made("header", "", "", heading, remove, ...buttons), ...parts);
  card.dataset.kind = entry.kind;
  if (entry.has_series) void drawSeries(card, entry);
  return card;
}

/** @typedef {[string, HTMLElement[], string[]]} Card title, parts, files */

const REPORTS = ["pdf", "html", "json"];

/** @param {Data} entry @returns {Card} */
function logParts({ name, told }) {
  const [log] = told.logs;
  const said = word("thermal-log_facts", { rows: log.rows, step: duration(log.usual_step_s),
    lasts: duration(log.duration_s + log.usual_step_s) }); // a row stands until the next one
  const findings = findingsOf(told.findings);
  const remarks = told.reading_codes.map((/** @type {Data} */ one) => one.text);
  const rows = log.channels.map((/** @type {Data} */ one) => [
    `${one.name}${one.unit ? ` [${one.unit}]` : ""}`, one]);
  const bare = log.channels.filter((/** @type {Data} */ one) => !one.unit);
  const names = bare.map((/** @type {Data} */ one) => one.name).join(", ");
  return [name, [
    made("p", said),
    ...(bare.length ? [made("p", word("thermal-no_unit", { names }))] : []),
    ...(findings.length ? listed(word("thermal-findings"), findings)
      : bare.length < rows.length ? [made("p", word("thermal-no_findings"), "muted")] : []),
    ...listed(word("thermal-remarks"), remarks), made("div"),
    details("thermal-channels", columnsOf("thermal-channel", CHANNELS, rows)),
  ], []];
}

/** What is doubtful of sensors, below what to do about it. @param {Data[]} found */
function findingsOf(found, mark = (/** @type {Data} */ _) => "") {
  return [...new Set(found.map(({ remedy }) => remedy))].map((remedy) => {
    const alike = found.filter((one) => one.remedy === remedy);
    const rows = alike.map((one) => made("li", [inOwnWords(one.text), mark(one),
      one.time_s && `(${word("thermal-between",
        { from: duration(one.time_s[0]), to: duration(one.time_s[1]) })})`].filter(Boolean).join(" ")));
    return made("li", remedy, alike[0].serious ? "bench-serious" : "", made("ul", "", "", ...rows));
  });
}

/** @param {Data} entry @param {string[]} names @returns {Card} */
function modelParts(entry, names) {
  const { outputs, warnings, findings = [], selection } = entry.told;
  const all = /** @type {[string, Data][]} */ (Object.entries(outputs));
  const said = all.flatMap(([name, output]) =>
    output.warnings.map((/** @type {string} */ text) => `${name}: ${text}`));
  const parts = /** @type {[string, Data][]} */ (all.flatMap(([name, output]) =>
    output.parts.map((/** @type {Data} */ part) => [`${name} ← ${part.input}`, part])));
  const held = new Set(all.map(([, { held_out }]) => held_out?.what).filter(Boolean));
  const next = all.map(([, { next_test }]) => next_test?.text).filter(Boolean);
  const chosen = (/** @type {Data} */ { channel }) => selection && !outputs[channel]
    ? word(selection.channels.includes(channel) ? "thermal-taken" : "thermal-left_out") : "";
  const from = names.length ? ` (${names.join(", ")})` : "";
  return [`${entry.name}: ${all.map(([name]) => name).join(", ")}${from}`, [
    columnsOf("thermal-output", IDENTIFIED, all),
    ...[...held].map((text) => made("p", text, "muted")),
    columnsOf("thermal-part", PARTS, parts), made("div"),
    ...warned([...said, ...warnings]),
    ...listed(word("thermal-findings"), findingsOf(findings, chosen)),
    ...next.map((text) => made("p", text)), plcOf(entry),
  ], ["model", ...(names.length ? REPORTS : [])]];
}

/** @param {Data} entry @param {string[]} names @returns {Card} */
function verificationParts({ name, told }, [model]) {
  return [word("thermal-verification", { model, log: name }), [
    columnsOf("thermal-output", VERIFIED, Object.entries(told.outputs)), made("div"),
    ...warned([...told.left_over, ...told.warnings]),
  ], REPORTS];
}

/** @param {Data} entry @returns {Card} */
function comparisonParts({ name, told }) {
  const rows = told.models.flatMap((/** @type {Data} */ model) =>
    Object.entries(model.outputs).map(([output, figures]) => [`${model.name}: ${output}`, figures]));
  const said = new Set(told.models.flatMap((/** @type {Data} */ model) => model.warnings));
  return [word("thermal-comparison", { log: name }), [
    columnsOf("thermal-model", VERIFIED, rows), ...warned([...said]),
  ], REPORTS];
}

// ---- parts --------------------------------------------------------------------------------------

/** @param {string[]} said */
const warned = (said) => said.length ? listed(word("thermal-warnings"), said)
  : [made("p", word("thermal-no_warnings"), "muted")];

/** @param {string} title @param {HTMLElement} inner */
function details(title, inner) {
  return made("details", "", "", made("summary", word(title)), inner);
}

/**
 * @param {string} first head of the names
 * @param {Column[]} columns
 * @param {[string, Data][]} rows name and values
 */
function columnsOf(first, columns, rows) {
  return tableOf(word(first), [first, ...columns.map(([key]) => key)].map((key) => word(key)),
    rows.map(([name, row]) =>
      [titleCell(name), ...columns.map(([, digits, of]) => numberCell(of(row), digits))]));
}

/** Charts stand in the empty part of a card. @param {HTMLElement} card @param {Data} entry */
async function drawSeries(card, entry) {
  const answer = await fetch(`/thermal/series/${entry.id}`).catch(() => null);
  const place = card.querySelector(":scope > div:empty");
  if (!answer?.ok || !place) return;
  const { series } = await answer.json();
  for (const { log, output, lines } of series) {
    if (output) draw(place, `${output}, ${log}`, `${output} [µm]`, lines);
    else {
      const { channels } = entry.told.logs[0];
      for (const [quantity, title] of Object.entries(QUANTITIES)) {
        const own = lines.filter((/** @type {Data} */ { name }) => channels.some(
          (/** @type {Data} */ one) => one.name === name && (one.unit ? one.quantity : "") === quantity));
        const units = [...new Set(own.map((/** @type {Data} */ { unit }) => SIGNS[unit] ?? unit))];
        const unit = quantity && ` [${units.join(", ")}]`;
        if (own.length) draw(place, log, word(title) + unit, own);
      }
    }
  }
}

/** @param {Element} place @param {string} label @param {string} yTitle @param {Data[]} lines */
function draw(place, label, yTitle, lines) {
  const element = made("div", "", "bench-chart");
  place.append(element);
  drawChart(element, {
    label, yTitle, xTitle: word("thermal-hours"),
    lines: lines.map(({ name, unit, time_h: x, values: y }) => ({
      ...LOOKS[name], x, y, unit: SIGNS[unit] ?? unit, digits: 2,
      name: Object.hasOwn(LOOKS, name) ? word(`thermal-line_${name}`) : name,
    })),
  });
}

const SIGNS = /** @type {Record<string, string>} */ ({ um: "µm", degC: "°C", degF: "°F" });

/** @param {Data} entry */
function plcOf(entry) {
  const made_of = /** @type {HTMLTemplateElement} */ (byId("plc")).content.cloneNode(true);
  const shown = details("thermal-plc", made("div", "", "", made_of));
  const form = /** @type {HTMLFormElement} */ (shown.querySelector("form"));
  const told = /** @type {HTMLElement} */ (shown.querySelector("[role=status]"));
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const asked = [...askedBy(form)].map(([name, value]) => [name, value.replaceAll(",", ".")]);
    const found = await work("/thermal/export", { model: entry.id, ...Object.fromEntries(asked) });
    if (!found) return;
    told.replaceChildren(...listed(word("thermal-warnings"), found.warnings),
      button(word("thermal-take_plc"), () => void download(`/thermal/plc/${entry.id}`)));
    told.querySelector("button")?.focus();
  });
  return shown;
}
