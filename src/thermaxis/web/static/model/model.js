// @ts-check
/** The model in force: its numbers once, where its inputs stand in their ranges every second. */
import { ask } from "../ask/ask.js";
import { byId, made, say } from "../elements.js";
import { latest, onNoData, onStatus } from "../live.js";
import { fillLive } from "./cells.js";
import { drawGains, drawStep } from "./charts.js";
import { word } from "../words.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */

const LONGEST_MS = 5000; // without the hash the effect is judged by the name

let wanted = "";
let shownSha256 = "";
let loading = false;
let mayAsk = false;
let asking = false;

onStatus((status) => {
  const key = `${status.model_file} ${status.model_sha256} ${status.diameter_mm}`;
  showFile(status.model_file, status.model_sha256);
  const same = status.model_sha256 === shownSha256;
  markOld(shownSha256 !== "" && !same);
  if (!(same && key === wanted) && !loading) void load(key);
  fillLive(status);
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
  show({ model: null, file: "", sha256: "", text, choices: [], html: "" });
}

/** @param {Data} values */
function show(values) {
  showFile(values.file, values.sha256);
  const wrong = byId("model-wrong");
  wrong.hidden = values.model !== null;
  say(wrong, values.text);
  showChoices(values);
  byId("model-outputs").innerHTML = values.html;
  document.querySelectorAll("#model-outputs > .output").forEach((section, k) => {
    const output = values.model?.outputs[k];
    const [steps, gains] = [".step-chart", ".gain-chart"].map((one) => section.querySelector(one));
    if (steps instanceof HTMLElement) drawStep(steps, output, values.model);
    if (gains instanceof HTMLElement) drawGains(gains, output, values.model);
  });
  const now = latest();
  if (now) fillLive(now);
}

/** @param {string} file @param {string} sha256 */
function showFile(file, sha256) {
  say(byId("model-file"), file || "–");
  say(byId("model-hash"), sha256 ? `sha256 ${sha256.slice(0, 16)}…` : "");
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
