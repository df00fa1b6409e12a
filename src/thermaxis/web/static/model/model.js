// @ts-check
/** The model in force: its numbers once, where its inputs stand in their ranges every second. */
import { ask } from "../ask/ask.js";
import { asked, Refused } from "../asked.js";
import { byId, say } from "../elements.js";
import { latest, onNoData, onStatus } from "../live.js";
import { fillLive } from "./cells.js";
import { drawGains, drawStep } from "./charts.js";
import { word } from "../words.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */

let shown = ""; // model and diameter of what is shown
let sha256 = "";
let choices = "";
let loading = false;
let asking = false;

onStatus((status) => {
  markOld(sha256 !== "" && status.model_sha256 !== sha256);
  if (keyOf(status) !== shown || status.model_sha256 !== sha256) void load(keyOf(status));
  fillLive(status);
});
onNoData(() => {
  if (shown === "") void load("");
});
byId("choose").addEventListener("change", () => { byId("choice").dataset.touched = "yes"; });
byId("choose").addEventListener("submit", (event) => {
  event.preventDefault();
  if (!asking) void choose();
});

/** @param {Data} status */
function keyOf(status) {
  return `${status.model_file} ${status.model_sha256} ${status.diameter_mm}`;
}

/** @param {string} key model and diameter that the values are of */
async function load(key) {
  if (loading) return;
  loading = true;
  try {
    const values = await asked("/model/values");
    [shown, sha256] = [key, values.sha256];
    show(values);
  } catch (error) { // asked again with the next status
    if (!(error instanceof Refused)) throw error;
    [shown, sha256] = ["", ""];
    show({ model: null, text: error.message, choices: "", html: "" });
  } finally {
    loading = false;
  }
}

/** Values of another model than the one in force are told to be so. @param {boolean} old */
function markOld(old) {
  byId("model-old").hidden = !old;
  byId("model").dataset.old = old ? "yes" : "no";
}

/** @param {Data} values */
function show({ model, text, choices: files, html }) {
  const now = latest();
  const wrong = byId("model-wrong");
  wrong.hidden = model !== null;
  say(wrong, text);
  markOld(false);
  showChoices(files);
  byId("model-outputs").innerHTML = html;
  document.querySelectorAll("#model-outputs > .output").forEach((section, k) => {
    const [steps, gains] = [".step-chart", ".gain-chart"].map((one) => section.querySelector(one));
    if (steps instanceof HTMLElement) drawStep(steps, model.outputs[k], model);
    if (gains instanceof HTMLElement) drawGains(gains, model.outputs[k], model);
  });
  if (now) fillLive(now);
}

// ---- another model ---------------------------------------------------------------------------

/** @param {string} file */
function optionOf(file) {
  const options = /** @type {NodeListOf<HTMLOptionElement>} */ (
    document.querySelectorAll("#choice option"));
  return [...options].find((one) => one.value === file);
}

/** What a person has chosen stays while it is there. @param {string} html */
function showChoices(html) {
  if (html === choices) return;
  const before = document.querySelector("#choice[data-touched]") ? chosen() : "";
  choices = html;
  byId("choose").hidden = html === "";
  byId("choose").innerHTML = html;
  const option = optionOf(before);
  if (!option) return;
  option.selected = true;
  byId("choice").dataset.touched = "yes";
}

function chosen() {
  return /** @type {HTMLSelectElement} */ (byId("choice")).value;
}

async function choose() {
  const file = chosen();
  asking = true;
  try {
    await load(shown); // the hash of the file as it is now
    const accepted = await ask("ChooseModel", [file], {
      text: () => [word("model-choose_text", { file }), word("model-choose_effect")],
      sha256: optionOf(file)?.dataset.sha256 || null,
    });
    if (!accepted) return;
    choices = ""; // from now on it shows what is in force
    document.getElementById("choice")?.removeAttribute("data-touched");
  } finally {
    asking = false;
  }
}
