// @ts-check
// What a probe measures with the compensation beside what it would measure without it.

import { drawChart } from "../chart/chart.js";
import { byId } from "../elements.js";
import { onNoData, onStatus } from "../live.js";
import {
  asked, newQuestion, pointsFor, query, Refused, refused, shows, spanOf, stateSpan,
  tellWrong, told, wireSpan,
} from "./past.js";
import { duration, moment, number, shortNames, word } from "../words.js";

/** @typedef {import("./past.js").Span} Span */
/** @typedef {import("./past.js").Past} Past */

/** @type {Span | null} */
let span = null;
/** @type {Span | null} */
let before = null;
const chart = byId("chart");
const which = /** @type {HTMLSelectElement} */ (byId("which"));
const NAMES = {
  uncompensated: word("probe-uncompensated"),
  compensated: word("probe-compensated"),
  model: word("probe-model"),
};
const COLORS = { uncompensated: 3, compensated: 1, model: 2 };
const DASHES = { uncompensated: "solid", compensated: "solid", model: "dash" };

/** @param {Span} wanted @param {number | null} hours */
async function show(wanted, hours = null) {
  const shown = stateSpan(wanted, hours);
  span = shown;
  const question = questionOf(shown);
  const signal = newQuestion();
  byId("told").textContent = word("history-loading");
  let found;
  try {
    const more = { name: which.value, points: pointsFor(chart) };
    found = await asked(`/probe/values?${query(shown, more)}`, signal);
  } catch (error) {
    if (!signal.aborted) refused(error, question);
    return;
  }
  tellWrong("");
  draw(shown, found.series);
  tell(found.figures, found.means_s);
  shows(question);
}

/** @param {Span | null} asked null: the fields state none @returns {import("./past.js").Question} */
function questionOf(asked) {
  return { span: asked, of: [which.value], said: shortNames(which.value) };
}

/** @param {Span} shown @param {Record<string, Past>} series */
function draw(shown, series) {
  const keys = /** @type {(keyof typeof NAMES)[]} */ (Object.keys(NAMES));
  drawChart(chart, {
    lines: keys.map((key) => ({
      name: NAMES[key],
      unit: "µm",
      x: series[key]?.t ?? [],
      y: series[key]?.mean ?? [],
      low: series[key]?.lowest,
      high: series[key]?.highest,
      color: COLORS[key],
      dash: DASHES[key],
    })),
    time: true,
    first: shown.first,
    last: shown.last,
    yTitle: "µm",
    label: word("probe-chart"),
    onSpan: (wanted) => {
      if (before === null) before = shown;
      void show(wanted ?? before);
      if (wanted === null) before = null;
    },
  });
  chart.dataset.drawn = String(Number(chart.dataset.drawn ?? "0") + 1);
}

/** @param {Record<string, any>} figures @param {number} meansS */
function tell(figures, meansS) {
  const um = (/** @type {number | null} */ value) => `${number(value, 1)}\u00a0µm`;
  const percent = figures.ratio === null ? null : 100 * figures.ratio;
  byId("range-compensated").textContent = um(figures.compensated_um);
  byId("range-uncompensated").textContent = um(figures.uncompensated_um);
  byId("range-model").textContent = um(figures.model_um);
  byId("ratio").textContent = `${number(percent, 0)}\u00a0%`;
  const values = {
    count: figures.values,
    first: moment(figures.first),
    last: moment(figures.last),
    length: duration((figures.last - figures.first) / 1000),
    step: duration(meansS),
  };
  byId("told").textContent = !figures.values
    ? word("probe-told_nothing")
    : meansS ? word("probe-told_means", values) : word("probe-told_values", values);
}

/** @param {number} hours */
async function showLength(hours) {
  const signal = newQuestion();
  const recorded = await told(() => asked("/history/series", signal), signal);
  if (!recorded || signal.aborted) return; // another length was pressed meanwhile
  const found = spanOf(hours, recorded);
  before = null;
  if (found) await show(found, hours);
  else tellWrong(word("history-nothing_recorded"));
}

/** @param {number | null} value @param {string} id */
function tellNow(id, value) {
  byId(id).textContent = `${number(value, 1)}\u00a0µm`;
}

onStatus((status) => {
  const sample = status.signals[`probe.${which.value}`];
  const output = status.outputs[which.value];
  const seen = sample?.good ? sample.read : null;
  const offset = output?.effective_um ?? output?.accepted_um ?? null;
  tellNow("now", seen);
  tellNow("now-without", seen === null || offset === null ? null : seen - offset);
});
onNoData(() => {
  tellNow("now", null);
  tellNow("now-without", null);
});
which.addEventListener("change", () => {
  if (span) void show(span);
});
wireSpan((hours) => void showLength(hours), (wanted) => {
  before = null;
  void show(wanted);
}, () => refused(new Refused(word("history-no_span")), questionOf(null)));
void showLength(8);
