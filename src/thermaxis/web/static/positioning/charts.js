// @ts-check
// Charts of an evaluated run and of a trend, from the numbers that the commands print.

import { drawChart } from "../chart/chart.js";
import { word } from "../words.js";
import { unitsOf } from "./result.js";

/** @typedef {Record<string, any>} Result */

/**
 * Mean deviations and spread at each target.
 * @param {HTMLElement} levels @param {HTMLElement} spread @param {Result} result
 */
export function drawLevels(levels, spread, result) {
  const { target: mm, deviation: unit } = unitsOf(result.test.kind);
  const { targets } = result.iso230_2;
  const x = targets.map((/** @type {Result} */ one) => one.position);
  const of = (/** @type {string} */ key) =>
    targets.map((/** @type {Result} */ one) => one[key] ?? null);
  const axes = { xTitle: `${word("positioning-chart_position")}, ${mm}`, yTitle: unit };
  const forward = { x, unit, digits: 2, color: 2, marker: "triangle-up", dash: "solid" };
  const backward = { ...forward, color: 3, marker: "square" };
  const title = (/** @type {string} */ name, /** @type {string} */ way) => `${name} ${way}`;
  const [measured, without] = [word("positioning-measured"), word("positioning-drift_free")];
  drawChart(levels, {
    ...axes,
    label: word("positioning-chart_levels"),
    lines: [
      { ...forward, name: title(measured, "↑"), y: of("mean_forward") },
      { ...backward, name: title(measured, "↓"), y: of("mean_backward") },
      { ...forward, name: title(without, "↑"), y: result.drift?.levels_forward ?? [], dash: "dash" },
      { ...backward, name: title(without, "↓"), y: result.drift?.levels_backward ?? [], dash: "dash" },
    ].filter((line) => line.y.some((/** @type {unknown} */ one) => one !== null)),
  });
  drawChart(spread, {
    ...axes,
    label: word("positioning-chart_spread"),
    lines: [
      { ...forward, name: "s ↑", y: of("s_forward") },
      { ...backward, name: "s ↓", y: of("s_backward") },
    ].filter((line) => line.y.some((/** @type {unknown} */ one) => one !== null)),
  });
}

/** Figures of several runs over time. @param {HTMLElement} element @param {Result} trend */
export function drawTrend(element, trend) {
  const { deviation: unit } = unitsOf(trend.kind);
  const dated = trend.runs.every((/** @type {Result} */ run) => run.start);
  const x = trend.runs.map((/** @type {Result} */ run, /** @type {number} */ k) =>
    dated ? run.start : k + 1);
  drawChart(element, {
    time: dated,
    yTitle: unit,
    label: word("positioning-trend_title"),
    xTitle: dated ? undefined : word("positioning-trend_run"),
    whole: true,
    lines: ["B", "E", "R", "A"].map((key) => {
      const y = trend.runs.map((/** @type {Result} */ run) => run.iso230_2[key]);
      const u = trend.runs.map((/** @type {Result} */ run) => run.uncertainty[key]);
      const edge = (/** @type {number} */ sign) => y.map((/** @type {any} */ one, /** @type {number} */ k) =>
        one === null || u[k] === null ? null : one + sign * u[k]);
      return { name: `${key} ± U`, x, y, low: edge(-1), high: edge(1), unit, digits: 2 };
    }),
  });
}
