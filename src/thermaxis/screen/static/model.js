// @ts-check
/** The model in force: its numbers once, where its inputs stand in their ranges every second. */
import { ask } from "./ask.js";
import { drawChart } from "./chart.js";
import {
  fillTable, made, part, rangeBar, say, showRange, showVerdict, verdict,
} from "./engineer.js";
import { inEnglish, sayWithEnglish } from "./english.js";
import { onNoData, onStatus } from "./live.js";
import { duration, number, signed, word } from "./words.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */

const LINES = 6;
const MARKERS = ["circle", "square", "diamond", "triangle-up", "cross", "x"];

/** @type {Data | null} */
let model = null;
let wanted = "";
let shownSha256 = "";
let loading = false;
/** @type {((status: Data) => void)[]} */
let live = [];

onStatus((status) => {
  const key = `${status.model_file} ${status.model_sha256} ${status.diameter_mm}`;
  showFile(status.model_file, status.model_sha256);
  const same = status.model_sha256 === shownSha256;
  markOld(shownSha256 !== "" && !same);
  if (!(same && key === wanted) && !loading) void load(key);
  for (const show of live) show(status);
});
onNoData(() => {
  if (wanted === "" && !loading) void load("");
});
part("choose").addEventListener("submit", (event) => {
  event.preventDefault();
  void choose();
});

/** @param {string} key model and diameter that the values are of */
async function load(key) {
  loading = true;
  try {
    const answer = await fetch("/model/values");
    const values = await answer.json().catch(() => ({}));
    if (!answer.ok) {
      clear(values.text ?? word("model.not_told"));
      return;
    }
    wanted = key;
    shownSha256 = values.sha256;
    markOld(false);
    show(values);
  } catch (error) {
    if (!(error instanceof TypeError)) throw error; // not reached: asked again with the next status
  } finally {
    loading = false;
  }
}

/** Values of another model than the one in force are told to be so. @param {boolean} old */
function markOld(old) {
  part("model-old").hidden = !old;
  part("model").dataset.old = old ? "yes" : "no";
}

/** Show nothing, and why. @param {string} text */
function clear(text) {
  wanted = "";
  shownSha256 = "";
  markOld(false);
  show({ model: null, file: "", sha256: "", text, detail: "", choices: [], outputs: [] });
}

/** @param {Data} values */
function show(values) {
  model = values.model;
  live = [];
  showFile(values.file, values.sha256);
  const wrong = part("model-wrong");
  wrong.hidden = model !== null;
  sayWithEnglish(wrong, [values.text, values.detail].filter(Boolean).join(" "), [values.detail]);
  showChoices(values);
  showWarnings(model?.warnings ?? []);
  part("model-outputs").replaceChildren();
  part("model-references").hidden = model === null;
  part("model-provenance").hidden = model === null;
  say(part("model-facts"), model === null ? "" : timesOf(model));
  if (model === null) {
    for (const name of values.outputs) showTold(name);
    return;
  }
  for (const output of model.outputs) showOutput(output, model);
  showReferences(model);
  showProvenance(model.provenance);
}

/** @param {string} file @param {string} sha256 */
function showFile(file, sha256) {
  say(part("model-file"), file || "–");
  say(part("model-hash"), sha256 ? `sha256 ${sha256.slice(0, 16)}…` : "");
}

/** @param {Data} model */
function timesOf(model) {
  const filter = model.input_filter_s
    ? word("model.filter", { time: duration(model.input_filter_s) })
    : word("model.no_filter");
  const times = word("model.times", {
    sample: duration(model.sample_time_s),
    gap: duration(model.longest_gap_s),
    hold: duration(model.longest_hold_s),
  });
  return `${times} ${filter}`;
}

/** @param {string[]} warnings */
function showWarnings(warnings) {
  const list = part("model-warnings");
  list.hidden = warnings.length === 0;
  list.replaceChildren(...warnings.map((text) => inEnglish("li", text)));
}

// ---- another model ---------------------------------------------------------------------------

/** @param {Data} values */
function showChoices(values) {
  const form = part("choose");
  const select = /** @type {HTMLSelectElement} */ (part("choice"));
  const may = part("model").dataset.mayChoose === "yes";
  form.hidden = values.choices.length === 0;
  select.replaceChildren(
    ...values.choices.map((/** @type {string} */ name) => {
      const option = /** @type {HTMLOptionElement} */ (made("option", name));
      option.value = name;
      option.selected = name === values.file;
      return option;
    }),
  );
  select.disabled = !may;
  /** @type {HTMLButtonElement} */ (part("choose-ask")).disabled = !may;
  part("choose-why").hidden = may;
}

async function choose() {
  const file = /** @type {HTMLSelectElement} */ (part("choice")).value;
  if (!file) return;
  const sha256 = await hashOf(file);
  await ask("ChooseModel", [file], {
    title: word("model.choose"),
    text: [word("model.choose_text", { file }), word("model.choose_effect")],
    effective: (status) => status.model_file === file
      && (sha256 === null || status.model_sha256 === sha256),
  });
}

/**
 * Hash of a file that may be chosen; null where the screen cannot read it: the loop may.
 * @param {string} file
 * @returns {Promise<string | null>}
 */
async function hashOf(file) {
  try {
    const answer = await fetch(`/model/choice?name=${encodeURIComponent(file)}`);
    return answer.ok ? (await answer.json()).sha256 : null;
  } catch (error) {
    if (!(error instanceof TypeError)) throw error;
    return null;
  }
}

// ---- what the loop tells of a model whose file cannot be read --------------------------------

/** @param {string} name */
function showTold(name) {
  const section = made("section", "", "output");
  section.append(contributionsPanel(name), limitsPanel({ name }));
  part("model-outputs").append(section);
}

/** @param {string} name */
function contributionsPanel(name) {
  const [table, weight] = [made("table"), verdict()];
  let drawn = "";
  /** @type {HTMLElement[]} */
  let values = [];
  live.push((status) => {
    const output = status.outputs[name];
    const parts = Object.keys(output?.parts_um ?? {});
    if (parts.join("\n") !== drawn) {
      drawn = parts.join("\n");
      values = parts.map(() => made("span", "–", "live"));
      fillTable(table, [word("model.part"), word("model.contribution")],
        parts.map((one, k) => [one, { number: values[k] ?? "" }]));
    }
    parts.forEach((one, k) => {
      if (values[k]) say(values[k], signed(output.parts_um[one], 1));
    });
    const found = output?.weight ?? null;
    showVerdict(weight, found === null ? null : found >= 1, weightWords(found));
  });
  return panel(word("model.contributions_title", { output: name }), wide(table), weight);
}

// ---- one output ------------------------------------------------------------------------------

/** @param {Data} output @param {Data} model */
function showOutput(output, model) {
  const section = made("section", "", "output");
  section.append(
    whole(stepPanel(output, model)),
    whole(partsPanel(output)),
    rangePanel(output, model),
    limitsPanel(output),
    ...gainPanel(output).map(whole),
  );
  part("model-outputs").append(section);
  drawStep(/** @type {HTMLElement} */ (section.querySelector(".step-chart")), output, model);
  const gains = /** @type {HTMLElement | null} */ (section.querySelector(".gain-chart"));
  if (gains) drawGains(gains, output, model);
}

/** @param {string} title @param {(HTMLElement | string)[]} content */
function panel(title, ...content) {
  const section = made("section", "", "panel");
  section.append(made("h2", title), ...content);
  return section;
}

/** @param {HTMLElement} section across the page */
function whole(section) {
  section.classList.add("whole");
  return section;
}

/** @param {HTMLElement} table */
function wide(table) {
  const box = made("div", "", "wide");
  box.append(table);
  return box;
}

/** @param {Data} output @param {Data} model */
function stepPanel(output, model) {
  const note = model.record_s === null
    ? word("model.step_record_unknown")
    : word("model.step_record", { record: duration(model.record_s) });
  return panel(
    word("model.step_title", { output: output.name }),
    made("div", "", "step-chart"),
    made("p", note, "note"),
  );
}

/** @param {HTMLElement} element @param {Data} output @param {Data} model */
function drawStep(element, output, model) {
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
        ? [{ x: model.record_s / unit.seconds, text: word("model.record_end"), kind: "alarm" }]
        : []),
    ],
    bands: output.parts.map((/** @type {Data} */ one) => ({
      high: one.dc_gain_um_per_k,
      text: word("model.dc_of", { part: one.name, gain: signed(one.dc_gain_um_per_k, 2) }),
    })),
    xTitle: word("model.step_time", { unit: unit.name }),
    yTitle: word("model.step_axis"),
    label: word("model.step_title", { output: output.name }),
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
function partsPanel(output) {
  const table = made("table", "", "parts-table");
  const head = ["part", "input", "direct", "sections", "delay", "dc", "static", "factor"];
  const names = {
    part: word("model.part"),
    input: word("model.input"),
    direct: word("model.direct"),
    sections: word("model.sections"),
    delay: word("model.delay"),
    dc: word("model.dc"),
    static: word("model.static"),
    factor: word("model.factor"),
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
    word("model.parts_title", { output: output.name }),
    wide(table),
    made("p", word("model.offset", { offset: signed(output.offset_um, 1) }), "note"),
  );
}

/** @param {Data} one */
function inputOf(one) {
  return one.minus ? `${one.plus} − ${one.minus}` : one.plus;
}

/** @param {Data} one */
function sectionsOf(one) {
  const list = made("div", "", "sections");
  if (!one.sections.length) list.textContent = word("model.no_sections");
  for (const { gain_um_per_k: gain, time_constant_s: tau } of one.sections) {
    list.append(made("div", `${signed(gain, 3)} µm/K, τ ${number(tau, 1)} s (${duration(tau)})`));
  }
  return list;
}

// ---- where it may be believed ----------------------------------------------------------------

/** @param {Data} output @param {Data} model */
function rangePanel(output, model) {
  const table = made("table");
  const rows = output.parts.map((/** @type {Data} */ one) => {
    const [now, bar, said] = [made("span", "–", "live"), rangeBar(), verdict()];
    showRange(bar, { low: one.lowest_k, high: one.highest_k, value: null });
    live.push((status) => {
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
      word("model.part"),
      word("model.input"),
      word("model.input_now"),
      word("model.trained"),
      word("model.validity"),
    ],
    rows,
  );
  const weight = verdict();
  live.push((status) => {
    const found = status.outputs[output.name]?.weight ?? null;
    showVerdict(weight, found === null ? null : found >= 1, weightWords(found));
  });
  const rule = word("model.validity_rule", {
    margin: number(model.margin_k, 1),
    lowest: `${number(100 * model.lowest_weight, 0)} %`,
  });
  const title = word("model.validity_title", { output: output.name });
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
  if (one.lowest_k === null) return word("model.range_unknown");
  const inside = insideOf(one, value);
  if (value === null || inside === null) return word("model.no_value");
  if (inside) return word("model.inside");
  const distance = Math.max(one.lowest_k - value, value - one.highest_k);
  return word("model.outside", { distance: number(distance, 1) });
}

/** @param {number | null} weight */
function weightWords(weight) {
  if (weight === null) return word("model.weight_unknown");
  if (weight >= 1) return word("model.weight_full");
  if (weight <= 0) return word("model.weight_none");
  return word("model.weight_part", { weight: number(100 * weight, 0) });
}

// ---- gain by diameter, limits ----------------------------------------------------------------

/** @param {Data} output @returns {HTMLElement[]} */
function gainPanel(output) {
  const gained = output.parts.filter((/** @type {Data} */ one) => one.gain_by_diameter.length);
  if (!gained.length) return [];
  const table = made("table");
  fillTable(
    table,
    [word("model.part"), word("model.diameter"), word("model.gain")],
    gained.flatMap((/** @type {Data} */ one) => [
      ...one.gain_by_diameter.map((/** @type {Data} */ point) => [
        one.name,
        { number: number(point.diameter_mm, 0) },
        { number: number(point.gain, 3) },
      ]),
      [one.name, word("model.tool_point"), { number: number(one.tool_gain, 3) }],
    ]),
  );
  const split = made("div", "", "outputs-split");
  split.append(made("div", "", "gain-chart"), wide(table));
  const held = gained.some((/** @type {Data} */ one) => one.gain_held);
  const note = made("p", word(held ? "model.gain_held" : "model.gain_note"), "note");
  return [panel(word("model.gain_title", { output: output.name }), split, note)];
}

/** @param {HTMLElement} element @param {Data} output @param {Data} model */
function drawGains(element, output, model) {
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
      : [{ x: at, text: word("model.diameter_now", { diameter: number(at, 0) }), kind: "alarm" }],
    xTitle: word("model.diameter"),
    yTitle: word("model.gain"),
    still: true,
    label: word("model.gain_title", { output: output.name }),
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

/** @param {Data} output */
function limitsPanel(output) {
  const table = made("table");
  const rows = [
    ["largest_um", word("model.limit_largest"), "µm", 1],
    ["soft_um", word("model.limit_soft"), "µm", 1],
    ["total_um", word("model.limit_total"), "µm", 1],
    ["largest_rate_um_per_s", word("model.limit_rate"), "µm/s", 3],
    ["deadband_um", word("model.limit_deadband"), "µm", 2],
    ["largest_trim_um", word("model.limit_trim"), "µm", 1],
  ];
  const cells = rows.map(([key, name, unit, digits]) => {
    const value = made("span", "–", "live");
    live.push((status) => {
      const found = status.outputs[output.name]?.limits?.[String(key)] ?? null;
      say(value, number(found, Number(digits)));
    });
    return [String(name), { number: value }, String(unit)];
  });
  fillTable(table, [word("model.limit"), word("model.value"), word("model.unit")], cells);
  return panel(word("model.limits_title", { output: output.name }), wide(table));
}

// ---- references and provenance ---------------------------------------------------------------

/** @param {Data} model */
function showReferences(model) {
  const stated = model.reference === "stated";
  const kind = stated ? word("model.reference_stated") : word("model.reference_start");
  say(part("model-reference-kind"), kind);
  const channels = new Set();
  for (const output of model.outputs) {
    for (const one of output.parts) {
      channels.add(one.plus);
      if (one.minus) channels.add(one.minus);
    }
  }
  const rows = [...channels].map((name) => {
    const now = made("span", "–", "live");
    live.push((status) => say(now, number(status.inputs[name]?.reference_c ?? null, 2)));
    return [String(name), { number: number(model.reference_c[name] ?? null, 2) }, { number: now }];
  });
  const table = part("reference-table");
  const trained = stated ? word("model.reference_of_model") : word("model.reference_of_training");
  fillTable(table, [word("model.channel"), trained, word("model.reference_now")], rows);
}

/** @param {Data} provenance */
function showProvenance(provenance) {
  const facts = part("provenance-facts");
  const none = word("model.not_stated");
  facts.replaceChildren(
    made("dt", word("model.method")),
    made("dd", provenance.method || none),
    made("dt", word("model.program")),
    made("dd", provenance.program || none),
    made("dt", word("model.date")),
    made("dd", provenance.date || none),
  );
  fillTable(
    part("log-table"),
    [word("model.log"), word("model.rows"), word("model.first_row"), "sha256"],
    provenance.logs.map((/** @type {Data} */ log) => [
      log.name,
      { number: String(log.rows) },
      { number: String(log.first_row) },
      made("span", log.sha256 ? `${log.sha256.slice(0, 16)}…` : none, "hash"),
    ]),
  );
  const figures = Object.entries(provenance.figures);
  fillTable(
    part("figure-table"),
    [word("model.figure"), word("model.value")],
    figures.map(([name, value]) => [figureName(name), { number: number(value, 2) }]),
  );
}

/** @param {string} name such as Z_um.fit_percent */
function figureName(name) {
  const at = name.lastIndexOf(".");
  const [of, figure] = [name.slice(0, Math.max(0, at)), name.slice(at + 1)];
  return figure === "fit_percent" ? word("model.fit_percent", { output: of }) : name;
}
