// @ts-check
// What a probe measures with the compensation beside what it would measure without it.

import { asked } from "../asked.js";
import { drawChart } from "../chart/chart.js";
import { byId } from "../elements.js";
import { onNoData, onStatus } from "../live.js";
import { askedOf, pageOfPast, pointsFor } from "./past.js";
import { duration, moment, number, word } from "../words.js";

/** @typedef {import("./past.js").Span} Span */
/** @typedef {import("./past.js").Past} Past */

const chart = byId("chart");
const which = /** @type {HTMLSelectElement} */ (byId("which"));
const NAMES = {
  uncompensated: word("probe-uncompensated"),
  compensated: word("probe-compensated"),
  model: word("probe-model"),
};
const COLORS = { uncompensated: 3, compensated: 1, model: 2 };
const DASHES = { uncompensated: "solid", compensated: "solid", model: "dash" };

const page = pageOfPast({
  chart,
  recorded: (signal) => asked("/history/series", { signal }),
  find: (shown, signal) => {
    const more = { name: which.value, points: pointsFor(chart) };
    return askedOf("/probe/values", shown, more, signal);
  },
  draw: (shown, found) => draw(shown, found.series),
  tell: (_, found) => tell(found.figures, found.means_s),
});

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
    onSpan: page.pointedAt,
  });
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
which.addEventListener("change", page.showAgain);
void page.showLength(8);
