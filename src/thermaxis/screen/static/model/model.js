// @ts-check
/** The model in force: its numbers once, where its inputs stand in their ranges every second. */
import { ask } from "../ask/ask.js";
import { byId, inEnglish, made, say } from "../elements.js";
import { fillTable, whole } from "./engineer.js";
import { onNoData, onStatus } from "../live.js";
import { contributionsPanel, limitsPanel, rangePanel } from "./now.js";
import { drawGains, drawStep, gainPanel, partsPanel, stepPanel } from "./parts.js";
import { duration, number, shortNames, word } from "../words.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */

const LONGEST_MS = 5000; // without the hash the effect is judged by the name

/** @type {Data | null} */
let model = null;
let wanted = "";
let shownSha256 = "";
let loading = false;
let mayAsk = false;
let asking = false;
/** @type {((status: Data) => void)[]} */
let live = [];
const follow = (/** @type {(status: Data) => void} */ show) => { live.push(show); };

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
byId("choice").addEventListener("change", () => { byId("choice").dataset.touched = "yes"; });
byId("choose").addEventListener("submit", (event) => {
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
      clear(values.text ?? word("model-not_told"));
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
  byId("model-old").hidden = !old;
  byId("model").dataset.old = old ? "yes" : "no";
}

/** Show nothing, and why. @param {string} text */
function clear(text) {
  wanted = "";
  shownSha256 = "";
  markOld(false);
  show({ model: null, file: "", sha256: "", text, choices: [], outputs: [] });
}

/** @param {Data} values */
function show(values) {
  model = values.model;
  live = [];
  showFile(values.file, values.sha256);
  const wrong = byId("model-wrong");
  wrong.hidden = model !== null;
  say(wrong, values.text);
  showChoices(values);
  showWarnings(model?.warnings ?? []);
  byId("model-outputs").replaceChildren();
  byId("model-references").hidden = model === null;
  byId("model-provenance").hidden = model === null;
  say(byId("model-facts"), model === null ? "" : timesOf(model));
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
  say(byId("model-file"), file || "–");
  say(byId("model-hash"), sha256 ? `sha256 ${sha256.slice(0, 16)}…` : "");
}

/** @param {Data} model */
function timesOf(model) {
  const filter = model.input_filter_s
    ? word("model-filter", { time: duration(model.input_filter_s) })
    : word("model-no_filter");
  const times = word("model-times", {
    sample: duration(model.sample_time_s),
    gap: duration(model.longest_gap_s),
    hold: duration(model.longest_hold_s),
  });
  return `${times} ${filter}`;
}

/** @param {string[]} warnings */
function showWarnings(warnings) {
  const list = byId("model-warnings");
  list.hidden = warnings.length === 0;
  list.replaceChildren(...warnings.map((text) => inEnglish("li", text)));
}

// ---- another model ---------------------------------------------------------------------------

/** @param {Data} values */
function showChoices(values) {
  const form = byId("choose");
  const select = /** @type {HTMLSelectElement} */ (byId("choice"));
  const may = byId("model").dataset.mayChoose === "yes";
  const chosen = fileChosen(select, values);
  form.hidden = values.choices.length === 0;
  select.replaceChildren(
    ...values.choices.filter((/** @type {Data} */ one) => one.model).map(
      (/** @type {Data} */ { name }) => {
        const option = /** @type {HTMLOptionElement} */ (made("option", name));
        option.value = name;
        option.selected = name === chosen;
        return option;
      }),
  );
  const none = select.options.length === 0;
  select.disabled = !may || none;
  mayAsk = may && !none;
  turnAsk();
  showRefused(values.choices.filter((/** @type {Data} */ one) => one.reason));
  byId("choose-why").hidden = may;
}

/**
 * What a person has chosen stays when the values come anew; else it is the model in force.
 * @param {HTMLSelectElement} select
 * @param {Data} values
 * @returns {string}
 */
function fileChosen(select, values) {
  const stays = select.dataset.touched === "yes"
    && values.choices.some((/** @type {Data} */ one) => one.model && one.name === select.value);
  if (!stays) delete select.dataset.touched;
  return stays ? select.value : values.file;
}

function turnAsk() {
  /** @type {HTMLButtonElement} */ (byId("choose-ask")).disabled = !mayAsk || asking;
}

/** Files that cannot be chosen, or were not read, each with why. @param {Data[]} files */
function showRefused(files) {
  byId("choose-refused").hidden = files.length === 0;
  const lines = files.map((one) => {
    const line = made("li");
    line.append(made("b", one.name), ": ", made("span", one.reason));
    return line;
  });
  byId("choose-refused-list").replaceChildren(...lines);
}

async function choose() {
  const select = /** @type {HTMLSelectElement} */ (byId("choice"));
  const file = select.value;
  if (!file || asking) return;
  asking = true;
  turnAsk();
  try {
    const sha256 = await hashOf(file);
    const answer = await ask("ChooseModel", [file], {
      title: word("model-choose"),
      text: [word("model-choose_text", { file }), word("model-choose_effect")],
      sha256,
    });
    if (answer?.accepted) delete select.dataset.touched; // from now on it shows what is in force
  } finally {
    asking = false;
    turnAsk();
  }
}

/**
 * Hash of a file that may be chosen; null where the screen cannot read it: the loop may.
 * @param {string} file
 * @returns {Promise<string | null>}
 */
async function hashOf(file) {
  try {
    const answer = await fetch(`/model/choice?name=${encodeURIComponent(file)}`, {
      signal: AbortSignal.timeout(LONGEST_MS),
    });
    return answer.ok ? (await answer.json()).sha256 : null;
  } catch (error) {
    const late = error instanceof DOMException && error.name === "TimeoutError";
    if (!late && !(error instanceof TypeError)) throw error;
    return null;
  }
}

// ---- what the loop tells of a model whose file cannot be read --------------------------------

/** @param {string} name */
function showTold(name) {
  const section = made("section", "", "output");
  section.append(contributionsPanel(name, follow), limitsPanel({ name }, follow));
  byId("model-outputs").append(section);
}

// ---- one output ------------------------------------------------------------------------------

/** @param {Data} output @param {Data} model */
function showOutput(output, model) {
  const section = made("section", "", "output");
  section.append(
    whole(stepPanel(output, model)),
    whole(partsPanel(output)),
    rangePanel(output, model, follow),
    limitsPanel(output, follow),
    ...gainPanel(output).map(whole),
  );
  byId("model-outputs").append(section);
  drawStep(/** @type {HTMLElement} */ (section.querySelector(".step-chart")), output, model);
  const gains = /** @type {HTMLElement | null} */ (section.querySelector(".gain-chart"));
  if (gains) drawGains(gains, output, model);
}

// ---- references and provenance ---------------------------------------------------------------

/** @param {Data} model */
function showReferences(model) {
  const stated = model.reference === "stated";
  const kind = stated ? word("model-reference_stated") : word("model-reference_start");
  say(byId("model-reference-kind"), kind);
  const channels = new Set();
  for (const output of model.outputs) {
    for (const one of output.parts) {
      channels.add(one.plus);
      if (one.minus) channels.add(one.minus);
    }
  }
  const rows = [...channels].map((name) => {
    const now = made("span", "–", "live");
    follow((status) => say(now, number(status.inputs[name]?.reference_c ?? null, 2)));
    const trained = number(model.reference_c[name] ?? null, 2);
    return [shortNames(String(name)), { number: trained }, { number: now }];
  });
  const table = byId("reference-table");
  const trained = stated ? word("model-reference_of_model") : word("model-reference_of_training");
  fillTable(table, [word("model-channel"), trained, word("model-reference_now")], rows);
}

/** @param {Data} provenance */
function showProvenance(provenance) {
  const facts = byId("provenance-facts");
  const none = word("model-not_stated");
  facts.replaceChildren(
    made("dt", word("model-method")),
    made("dd", provenance.method || none),
    made("dt", word("model-program")),
    made("dd", provenance.program || none),
    made("dt", word("model-date")),
    made("dd", provenance.date || none),
  );
  fillTable(
    byId("log-table"),
    [word("model-log"), word("model-rows"), word("model-first_row"), "sha256"],
    provenance.logs.map((/** @type {Data} */ log) => [
      log.name,
      { number: String(log.rows) },
      { number: String(log.first_row) },
      made("span", log.sha256 ? `${log.sha256.slice(0, 16)}…` : none, "hash"),
    ]),
  );
  const figures = Object.entries(provenance.figures);
  fillTable(
    byId("figure-table"),
    [word("model-figure"), word("model-value")],
    figures.map(([name, value]) => [figureName(name), { number: number(value, 2) }]),
  );
}

/** @param {string} name such as Z_um.fit_percent */
function figureName(name) {
  const at = name.lastIndexOf(".");
  const [of, figure] = [name.slice(0, Math.max(0, at)), name.slice(at + 1)];
  return figure === "fit_percent" ? word("model-fit_percent", { output: shortNames(of) }) : name;
}
