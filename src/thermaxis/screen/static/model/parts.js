// @ts-check
/** What one output of a model is made of: its parts with their steps, and gains by diameter. */
import { drawChart } from "../chart/chart.js";
import { made } from "../elements.js";
import { fillTable, panel, wide } from "./engineer.js";
import { duration, exactly, number, shortNames, signed, word } from "../words.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */

const LINES = 6;
const MARKERS = ["circle", "square", "diamond", "triangle-up", "cross", "x"];

// ---- step and parts --------------------------------------------------------------------------

/** @param {Data} output @param {Data} model */
export function stepPanel(output, model) {
  const note = model.record_s === null
    ? word("model-step_record_unknown")
    : word("model-step_record", { record: duration(model.record_s) });
  return panel(
    word("model-step_title", { output: shortNames(output.name) }),
    made("div", "", "step-chart"),
    made("p", note, "note"),
  );
}

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

/** @param {Data} output */
export function partsPanel(output) {
  const table = made("table", "", "parts-table");
  const head = ["part", "input", "direct", "sections", "delay", "dc", "static", "factor"];
  const names = {
    part: word("model-part"),
    input: word("model-input"),
    direct: word("model-direct"),
    sections: word("model-sections"),
    delay: word("model-delay"),
    dc: word("model-dc"),
    static: word("model-static"),
    factor: word("model-factor"),
  };
  fillTable(
    table,
    head.map((key) => names[/** @type {keyof typeof names} */ (key)]),
    output.parts.map((/** @type {Data} */ one) => [
      made("b", one.name),
      inputOf(one),
      { number: signed(one.direct_gain_um_per_k, 3) },
      sectionsOf(one),
      { number: one.delay_s ? duration(one.delay_s) : "0" },
      { number: signed(one.dc_gain_um_per_k, 3) },
      { number: signed(one.static_gain_um_per_k, 3) },
      { number: one.gain_by_diameter.length ? made("span", number(one.gain_now, 3), "live") : "1" },
    ]),
  );
  return panel(
    word("model-parts_title", { output: shortNames(output.name) }),
    wide(table),
    made("p", word("model-offset", { offset: signed(output.offset_um, 1) }), "note"),
  );
}

/** @param {Data} one */
export function inputOf(one) {
  const plus = shortNames(one.plus);
  return one.minus ? `${plus} − ${shortNames(one.minus)}` : plus;
}

/** @param {Data} one */
function sectionsOf(one) {
  const list = made("div", "", "sections");
  if (!one.sections.length) list.textContent = word("model-no_sections");
  for (const { gain_um_per_k: gain, time_constant_s: tau } of one.sections) {
    list.append(made("div", `${signed(gain, 3)} µm/K, τ ${number(tau, 1)} s (${duration(tau)})`));
  }
  return list;
}

// ---- gain by diameter ------------------------------------------------------------------------

/** @param {Data} output @returns {HTMLElement[]} */
export function gainPanel(output) {
  const gained = output.parts.filter((/** @type {Data} */ one) => one.gain_by_diameter.length);
  if (!gained.length) return [];
  const table = made("table");
  fillTable(
    table,
    [word("model-part"), word("model-diameter"), word("model-gain")],
    gained.flatMap((/** @type {Data} */ one) => [
      ...one.gain_by_diameter.map((/** @type {Data} */ point) => [
        one.name,
        { number: exactly(point.diameter_mm) },
        { number: number(point.gain, 3) },
      ]),
      [one.name, word("model-tool_point"), { number: number(one.tool_gain, 3) }],
    ]),
  );
  const split = made("div", "", "outputs-split");
  split.append(made("div", "", "gain-chart"), wide(table));
  const held = gained.some((/** @type {Data} */ one) => one.gain_held);
  const note = made("p", word(held ? "model-gain_held" : "model-gain_note"), "note");
  return [panel(word("model-gain_title", { output: shortNames(output.name) }), split, note)];
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
