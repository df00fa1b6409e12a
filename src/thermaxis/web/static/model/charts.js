// @ts-check
/** Charts of one output of a model: the steps of its parts, and gains by diameter. */
import { drawChart } from "../chart/chart.js";
import { duration, exactly, shortNames, signed, word } from "../words.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */

const LINES = 6;
const MARKERS = ["circle", "square", "diamond", "triangle-up", "cross", "x"];

/** @param {HTMLElement} element @param {Data} output @param {Data} model */
export function drawStep(element, output, model) {
  const { time_s: times, known, response_um_per_k: responses } = output.step;
  const unit = unitOf(times.at(-1));
  const x = times.map((/** @type {number} */ t) => t / unit.seconds);
  const lines = output.parts.flatMap((/** @type {Data} */ one, /** @type {number} */ k) => {
    const y = responses[one.name];
    const look = { color: (k % LINES) + 1, marker: MARKERS[k % LINES], digits: 2 };
    const name = one.name;
    const first = { name, unit: "µm/K", x: x.slice(0, known), y: y.slice(0, known), ...look };
    const rest = { name, x: x.slice(known - 1), y: y.slice(known - 1), ...look };
    const more = known > 0 && known < x.length;
    const beyond = more ? [{ ...rest, dash: "dash", markers: 4, unlisted: true }] : [];
    return [{ ...first, dash: "solid" }, ...beyond];
  });
  const recorded = model.record_s !== null && known < times.length;
  drawChart(element, {
    lines,
    marks: [
      ...constantsOf(output).map(({ at, text }) => ({ x: at / unit.seconds, text })),
      ...(recorded
        ? [{ x: model.record_s / unit.seconds, text: word("model-record_end"), kind: "alarm" }]
        : []),
    ],
    bands: output.parts.map((/** @type {Data} */ one) => ({
      high: one.dc_gain_um_per_k,
      text: word("model-dc_of", { part: one.name, gain: signed(one.dc_gain_um_per_k, 2) }),
    })),
    xTitle: word("model-step_time", { unit: unit.name }),
    yTitle: word("model-step_axis"),
    label: word("model-step_title", { output: shortNames(output.name) }),
  });
}

/** @param {number} seconds */
function unitOf(seconds) {
  if (seconds > 3 * 86400) return { seconds: 86400, name: "d" };
  if (seconds > 3 * 3600) return { seconds: 3600, name: "h" };
  return seconds > 180 ? { seconds: 60, name: "min" } : { seconds: 1, name: "s" };
}

/**
 * Return every time constant once, with the parts that have it.
 * @param {Data} output
 */
function constantsOf(output) {
  const found = /** @type {Map<string, {at: number, tau: number, names: string[]}>} */ (new Map());
  for (const one of output.parts) {
    for (const section of one.sections) {
      const tau = section.time_constant_s;
      const at = one.delay_s + tau;
      const key = `${tau.toPrecision(6)} ${at.toPrecision(6)}`;
      const entry = found.get(key) ?? { at, tau, names: [] };
      if (!entry.names.includes(one.name)) entry.names.push(one.name);
      found.set(key, entry);
    }
  }
  return [...found.values()]
    .sort((a, b) => a.at - b.at)
    .map(({ at, tau, names }) => ({ at, text: `τ ${duration(tau)} (${names.join(", ")})` }));
}

/** @param {HTMLElement} element @param {Data} output @param {Data} model */
export function drawGains(element, output, model) {
  const gained = output.parts.filter((/** @type {Data} */ one) => one.gain_by_diameter.length);
  const at = model.diameter_mm;
  const [low, high] = spanOf(gained, at);
  drawChart(element, {
    first: low - 0.04 * (high - low),
    last: high + 0.04 * (high - low),
    lines: gained.map((/** @type {Data} */ one) => ({
      name: one.name,
      x: one.gain_by_diameter.map((/** @type {Data} */ point) => point.diameter_mm),
      y: one.gain_by_diameter.map((/** @type {Data} */ point) => point.gain),
      digits: 3,
      dash: "solid",
      color: (output.parts.indexOf(one) % LINES) + 1,
      marker: MARKERS[output.parts.indexOf(one) % LINES],
    })),
    marks: at === null
      ? []
      : [{ x: at, text: word("model-diameter_now", { diameter: exactly(at) }), kind: "alarm" }],
    xTitle: word("model-diameter"),
    yTitle: word("model-gain"),
    still: true,
    label: word("model-gain_title", { output: shortNames(output.name) }),
  });
}

/** @param {Data[]} gained @param {number | null} at @returns {[number, number]} */
function spanOf(gained, at) {
  const all = gained.flatMap((one) =>
    one.gain_by_diameter.map((/** @type {Data} */ point) => point.diameter_mm),
  );
  if (at !== null) all.push(at);
  const [low, high] = [Math.min(...all), Math.max(...all)];
  return high > low ? [low, high] : [low - 1, high + 1];
}
