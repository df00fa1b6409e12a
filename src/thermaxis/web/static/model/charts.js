// @ts-check
/** Charts of one output of a model: the steps of its parts, and gains by diameter. */
import { drawChart } from "../chart/chart.js";
import { duration, exactly, shortNames, signed, word } from "../words.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */

const MARKERS = ["circle", "square", "diamond", "triangle-up", "cross", "x"];
const UNITS = /** @type {[number, number, string][]} */ (
  [[3 * 86400, 86400, "d"], [3 * 3600, 3600, "h"], [180, 60, "min"], [0, 1, "s"]]);

/** The looks of a part's line, solid or dashed. @param {Data} part @param {number} k its place */
function lookOf({ name }, k) {
  return { name, dash: "solid", color: (k % MARKERS.length) + 1, marker: MARKERS[k % MARKERS.length] };
}

/** @param {HTMLElement} element @param {Data} output @param {Data} model */
export function drawStep(element, { name, parts, step }, model) {
  const { time_s: times, known, response_um_per_k: responses } = step;
  const [, unitS, unit] = UNITS.find(([least]) => times.at(-1) > least) ?? UNITS[3];
  const x = times.map((/** @type {number} */ t) => t / unitS);
  const recorded = model.record_s !== null && known < times.length;
  drawChart(element, {
    lines: parts.flatMap((/** @type {Data} */ part, /** @type {number} */ k) => {
      const y = responses[part.name];
      const line = { ...lookOf(part, k), unit: "µm/K", digits: 2 };
      const first = { ...line, x: x.slice(0, known), y: y.slice(0, known) };
      if (!(known > 0 && known < x.length)) return [first];
      const rest = { x: x.slice(known - 1), y: y.slice(known - 1), dash: "dash", markers: 4 };
      return [first, { ...line, ...rest, unlisted: true }];
    }),
    marks: [
      ...constantsOf(parts).map(({ at, text }) => ({ x: at / unitS, text })),
      ...(recorded
        ? [{ x: model.record_s / unitS, text: word("model-record_end"), kind: "alarm" }]
        : []),
    ],
    bands: parts.map((/** @type {Data} */ part) => ({
      high: part.dc_gain_um_per_k,
      text: word("model-dc_of", { part: part.name, gain: signed(part.dc_gain_um_per_k, 2) }),
    })),
    xTitle: word("model-step_time", { unit }),
    yTitle: word("model-step_axis"),
    label: word("model-step_title", { output: shortNames(name) }),
  });
}

/** Every time constant once, with the parts that have it. @param {Data[]} parts */
function constantsOf(parts) {
  const found = /** @type {Map<string, {at: number, tau: number, names: Set<string>}>} */ (new Map());
  for (const { name, delay_s: delay, sections } of parts) {
    for (const { time_constant_s: tau } of sections) {
      const at = delay + tau;
      const key = `${tau.toPrecision(6)} ${at.toPrecision(6)}`;
      found.set(key, found.get(key) ?? { at, tau, names: new Set() });
      found.get(key)?.names.add(name);
    }
  }
  return [...found.values()]
    .sort((a, b) => a.at - b.at)
    .map(({ at, tau, names }) => ({ at, text: `τ ${duration(tau)} (${[...names].join(", ")})` }));
}

/** @param {HTMLElement} element @param {Data} output @param {Data} model */
export function drawGains(element, { name, parts }, { diameter_mm: at }) {
  const lines = parts.map((/** @type {Data} */ part, /** @type {number} */ k) => ({
    ...lookOf(part, k),
    x: part.gain_by_diameter.map((/** @type {Data} */ point) => point.diameter_mm),
    y: part.gain_by_diameter.map((/** @type {Data} */ point) => point.gain),
    digits: 3,
  })).filter((/** @type {Data} */ { x }) => x.length);
  const all = [...lines.flatMap((/** @type {Data} */ { x }) => x), ...(at === null ? [] : [at])];
  const [low, high] = [Math.min(...all), Math.max(...all)];
  const margin = high > low ? 0.04 * (high - low) : 1;
  drawChart(element, {
    first: low - margin,
    last: high + margin,
    lines,
    marks: at === null
      ? []
      : [{ x: at, text: word("model-diameter_now", { diameter: exactly(at) }), kind: "alarm" }],
    xTitle: word("model-diameter"),
    yTitle: word("model-gain"),
    still: true,
    label: word("model-gain_title", { output: shortNames(name) }),
  });
}
