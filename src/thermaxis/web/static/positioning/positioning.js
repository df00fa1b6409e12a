// @ts-check
// Send a measured run, and show what its evaluation says.

import { button, byId, made, say } from "../elements.js";
import { facts, shownOf } from "./result.js";
import { moment, word } from "../words.js";

/** @typedef {Record<string, any>} Result */

const NAME_CHARACTERS = 200;
const SECOND_MS = 1000;

/** How often a run was sent or a kept one chosen: only the last choice is shown. */
let chosen = 0;

/** @param {Result} result */
function show(result) {
  byId("run-nothing").hidden = true;
  byId("run-result").hidden = false;
  byId("run-name").textContent = result.name;
  byId("run-facts").textContent = facts(result);
  byId("run-shown").replaceChildren(...shownOf(result));
  const certificate = /** @type {HTMLAnchorElement} */ (byId("run-certificate"));
  certificate.href = `/positioning/certificate/${encodeURIComponent(result.id)}`;
  certificate.download = "";
  const frame = /** @type {HTMLIFrameElement} */ (byId("run-frame"));
  frame.dataset.report = `/positioning/report/${encodeURIComponent(result.id)}`;
  frame.removeAttribute("src");
  choose(false);
}

/** @param {boolean} report */
function choose(report) {
  const frame = /** @type {HTMLIFrameElement} */ (byId("run-frame"));
  if (report && frame.getAttribute("src") !== frame.dataset.report) {
    frame.src = frame.dataset.report ?? "";
  }
  frame.hidden = !report;
  byId("run-shown").hidden = report;
  byId("run-report").setAttribute("aria-pressed", String(report));
  byId("run-figures").setAttribute("aria-pressed", String(!report));
}

// ---- asking -------------------------------------------------------------------------------------

/** @param {string} text */
function refuse(text) {
  const wrong = byId("run-wrong");
  say(wrong, text);
  wrong.hidden = text === "";
  if (text === "") return;
  byId("run-result").hidden = true; // figures of an earlier run do not stand beside a refusal
  wrong.scrollIntoView({ block: "center" });
}

/**
 * Read an answer as JSON; null where the server is not there.
 * @param {Promise<Response>} asked
 * @returns {Promise<{ok: boolean, found: Result} | null>}
 */
async function answered(asked) {
  try {
    const answer = await asked;
    return { ok: answer.ok, found: await answer.json() };
  } catch {
    return null;
  }
}

/**
 * @param {FormData} data
 * @param {string} name
 * @returns {File | null}
 */
function fileOf(data, name) {
  const found = data.get(name);
  return found instanceof File && found.size > 0 ? found : null;
}

/** @param {FormData} data @param {string} name */
function chosenEmpty(data, name) {
  const found = data.get(name);
  return found instanceof File && found.name !== "" && found.size === 0;
}

/**
 * Address with the options, and what is sent: run, head and limits one after another.
 * @param {HTMLFormElement} form
 */
function request(form) {
  const data = new FormData(form);
  const run = fileOf(data, "file");
  const head = fileOf(data, "head");
  const limits = fileOf(data, "limits");
  const value = String(data.get("reference_value") ?? "").trim().replace(",", ".");
  const reference = data.get("reference");
  const query = new URLSearchParams({
    name: (run?.name ?? "").slice(-NAME_CHARACTERS),
    cycle: String(data.get("cycle") ?? ""),
    edition: String(data.get("edition") ?? ""),
    reference_cycle: reference === "cycle" ? value : "",
    reference_hours: reference === "hours" ? value : "",
    full: data.has("full") ? "yes" : "no",
    no_drift: data.has("drift") ? "no" : "yes",
    head_bytes: String(head?.size ?? 0),
    limits_bytes: String(limits?.size ?? 0),
  });
  const sent = [run, head, limits].filter((one) => one !== null);
  const noValue = reference && !value ? word("positioning-value_first") : "";
  const empty = chosenEmpty(data, "file");
  const none = word(empty ? "positioning-empty" : "positioning-file_first");
  const lacking = run ? noValue : none;
  return { address: `/positioning/upload?${query}`, body: new Blob(sent), lacking };
}

/**
 * @param {HTMLFormElement} form
 * @param {HTMLButtonElement} submit
 */
async function send(form, submit) {
  refuse("");
  const { address, body, lacking } = request(form);
  if (lacking) {
    refuse(lacking);
    return;
  }
  if (body.size > Number(form.dataset.largest)) {
    refuse(word("positioning-too_large"));
    return;
  }
  const told = byId("run-told");
  const begunMs = performance.now();
  const tell = () => {
    const elapsed = Math.floor((performance.now() - begunMs) / SECOND_MS);
    told.textContent = word("positioning-running", { elapsed, limit: form.dataset.limit });
  };
  tell();
  chosen += 1;
  byId("run-result").hidden = true; // nobody takes an earlier run's figures for this one's
  told.hidden = false;
  submit.disabled = true;
  const timer = setInterval(tell, SECOND_MS);
  const answer = await answered(fetch(address, {
    method: "POST",
    headers: {
      "Content-Type": "application/octet-stream",
      "X-Thermaxis-Token": document.body.dataset.token ?? "",
    },
    body,
  }));
  clearInterval(timer);
  told.hidden = true;
  submit.disabled = false;
  if (!answer) refuse(word("positioning-no_answer"));
  else if (answer.ok) show(answer.found);
  else refuse(String(answer.found.text ?? word("positioning-no_answer")));
  await list(false);
}

/** @param {string} id */
async function open(id) {
  chosen += 1;
  const mine = chosen;
  refuse("");
  const answer = await answered(fetch(`/positioning/result/${encodeURIComponent(id)}`));
  if (mine !== chosen) return;
  if (!answer) refuse(word("positioning-no_answer"));
  else if (answer.ok) show(answer.found);
  else {
    refuse(String(answer.found.text ?? word("positioning-gone")));
    await list(false);
  }
}

/** @param {boolean} first */
async function list(first) {
  const answer = await answered(fetch("/positioning/results"));
  if (!answer?.ok) return;
  const rows = /** @type {Result[]} */ (answer.found.results).map((one) => {
    const text = `${one.name} · ${moment(one.at)}`;
    return made("li", "", "", button(text, () => void open(one.id)));
  });
  byId("run-kept").replaceChildren(...rows);
  if (first && chosen === 0 && rows.length > 0) await open(answer.found.results[0].id);
}

/** @param {HTMLInputElement} input */
function nameFile(input) {
  const shown = input.parentElement?.querySelector(".run-file-name");
  if (shown) shown.textContent = input.files?.[0]?.name ?? word("positioning-no_file");
}

/** @param {HTMLFormElement} form */
function begin(form) {
  const submit = /** @type {HTMLButtonElement} */ (byId("run-submit"));
  const reference = /** @type {HTMLSelectElement} */ (form.elements.namedItem("reference"));
  const value = /** @type {HTMLInputElement} */ (form.elements.namedItem("reference_value"));
  const follow = () => {
    value.disabled = reference.value === "";
  };
  for (const input of form.querySelectorAll("input[type=file]")) {
    input.addEventListener("change", () => nameFile(/** @type {HTMLInputElement} */ (input)));
    nameFile(/** @type {HTMLInputElement} */ (input));
  }
  reference.addEventListener("change", follow);
  follow();
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    void send(form, submit);
  });
  byId("run-figures").addEventListener("click", () => choose(false));
  byId("run-report").addEventListener("click", () => choose(true));
  void list(true);
}

const form = document.getElementById("run-form");
if (form instanceof HTMLFormElement) begin(form);
