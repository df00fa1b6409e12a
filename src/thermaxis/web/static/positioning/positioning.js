// @ts-check
// Send a measured run, and show what its evaluation says.

import { drawLevels, drawTrend } from "./charts.js";
import { openForm, readToml, saidAndFile, tomlOf } from "./forms.js";
import { facts, shownOf, trendOf } from "./result.js";
import { button, byId, made, say } from "../elements.js";
import { post } from "../page.js";
import { moment, word } from "../words.js";

/** @typedef {Record<string, any>} Result */

const NAME_CHARACTERS = 200;
const READING_ERRORS = /--(decimal|date-order|units|target-tolerance)/;
const SECOND_MS = 1000;

const FORM_TITLES = {
  head: "positioning-head", limits: "positioning-limits", budget: "positioning-budget",
};
const TABLES = ["head", "limits", "budget", "plan"];
const READING = ["decimal", "date_order", "units", "target_tolerance"];

/** Ends the command that runs. */
let leaving = new AbortController();
/** The run that is shown. */
let shownId = "";

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
  for (const link of document.querySelectorAll("[data-kind]")) {
    const { kind } = /** @type {HTMLElement} */ (link).dataset;
    link.setAttribute("href", `/positioning/${kind}/${encodeURIComponent(result.id)}`);
    link.setAttribute("download", "");
  }
  shownId = result.id;
  byId("run-made").hidden = true;
  byId("table-told").replaceChildren();
  choose(false);
  const { top } = byId("run-result").getBoundingClientRect();
  if (top < 0 || top > innerHeight / 2) byId("run-result").scrollIntoView();
  drawLevels(byId("run-levels"), byId("run-spread"), result);
}

/** @param {boolean} report */
function choose(report) {
  const frame = /** @type {HTMLIFrameElement} */ (byId("run-frame"));
  if (report && frame.getAttribute("src") !== frame.dataset.report) {
    frame.src = frame.dataset.report ?? "";
  }
  frame.hidden = !report;
  byId("run-shown").hidden = report;
  byId("run-charts").hidden = report;
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

/** What a form's fields hold. @param {FormData} data @param {string} name */
function text(data, name) {
  return String(data.get(name) ?? "").trim();
}

/**
 * Address with the options, and what is sent: the run and what goes along, one after another.
 * @param {HTMLFormElement} form
 */
function request(form) {
  const data = new FormData(form);
  const runs = /** @type {File[]} */ (data.getAll("file")).filter((one) => one.size > 0);
  const tables = TABLES.map((name) => fileOf(data, name) ?? new Blob([tomlOf(name)]));
  const value = text(data, "reference_value").replace(",", ".");
  const reference = data.get("reference");
  const query = new URLSearchParams(READING.map((name) => {
    const stated = text(data, name);
    return [name, name === "units" ? stated : stated.replace(",", ".")];
  }));
  const named = (/** @type {File} */ run) => run.name.slice(-NAME_CHARACTERS);
  if (runs.length > 1) {
    for (const run of runs) query.append("name", named(run));
    for (const run of runs) query.append("bytes", String(run.size));
    return { address: `/positioning/trend?${query}`, body: new Blob(runs), lacking: "" };
  }
  for (const [name, stated] of Object.entries({
    name: runs.length ? named(runs[0]) : "",
    cycle: text(data, "cycle"),
    edition: text(data, "edition"),
    reference_cycle: reference === "cycle" ? value : "",
    reference_hours: reference === "hours" ? value : "",
    full: data.has("full") ? "yes" : "no",
    no_drift: data.has("drift") ? "no" : "yes",
  })) query.set(name, stated);
  TABLES.forEach((name, k) => query.set(`${name}_bytes`, String(tables[k].size)));
  const noValue = reference && !value ? word("positioning-value_first") : "";
  const empty = chosenEmpty(data, "file");
  const none = word(empty ? "positioning-empty" : "positioning-file_first");
  const lacking = runs.length ? noValue : none;
  return { address: `/positioning/upload?${query}`, body: new Blob([...runs, ...tables]), lacking };
}

/**
 * Ask for something that takes a while: the time is told, and it can be given up.
 * @param {string} address
 * @param {Blob | string} body
 */
async function work(address, body) {
  const [told, cancel] = [byId("run-told"), byId("run-cancel")];
  const begunMs = performance.now();
  const { limit } = byId("run-form").dataset;
  const tell = () => {
    const elapsed = Math.floor((performance.now() - begunMs) / SECOND_MS);
    told.textContent = word("positioning-running", { elapsed, limit });
  };
  const submit = /** @type {HTMLButtonElement} */ (byId("run-submit"));
  tell();
  told.hidden = false;
  cancel.hidden = false;
  submit.disabled = true;
  leaving = new AbortController();
  const mine = leaving.signal;
  const timer = setInterval(tell, SECOND_MS);
  const answer = await answered(post(address, body, true, mine));
  clearInterval(timer);
  told.hidden = true;
  cancel.hidden = true;
  submit.disabled = false;
  if (answer?.ok) return answer.found;
  const silent = word(mine.aborted ? "positioning-cancelled" : "positioning-no_answer");
  refuse(String(answer?.found.text ?? silent));
  const [, asks = ""] = READING_ERRORS.exec(answer?.found.text ?? "") ?? [];
  if (asks) {
    const reading = /** @type {HTMLDetailsElement} */ (byId("run-reading"));
    reading.open = true;
    const field = reading.querySelector(`[name=${asks.replace("-", "_")}]`);
    /** @type {HTMLElement | null} */ (field)?.focus();
  }
  return null;
}

/** @param {HTMLFormElement} form */
async function send(form) {
  refuse("");
  const { address, body, lacking } = request(form);
  if (lacking) {
    refuse(lacking);
    return;
  }
  const several = address.startsWith("/positioning/trend");
  if (body.size > (several ? 3 : 1) * Number(form.dataset.largest)) {
    refuse(word("positioning-too_large"));
    return;
  }
  chosen += 1;
  byId("run-result").hidden = true; // nobody takes an earlier run's figures for this one's
  const found = await work(address, body);
  if (found && several) showTrend(found);
  else if (found) show(found);
  await list(false);
}

/** @param {string} title @param {HTMLElement[]} content */
function showMade(title, content) {
  byId("run-nothing").hidden = true;
  byId("run-made").hidden = false;
  byId("made-chart").hidden = true;
  byId("made-title").textContent = title;
  byId("made-shown").replaceChildren(...content);
  byId("run-made").scrollIntoView({ block: "nearest" });
}

/** @param {Result} found */
function showTrend(found) {
  showMade(word("positioning-trend_title"), trendOf(found));
  byId("made-chart").hidden = false;
  drawTrend(byId("made-chart"), found);
}

/** What a form asks of a command. @param {HTMLFormElement} form */
function asked(form) {
  const data = new FormData(form);
  for (const [name, value] of [...data]) data.set(name, value === "on" ? "yes" : String(value).trim());
  return new URLSearchParams(/** @type {any} */ ([...data]));
}

/** Forms that ask for a file: table, plan and program. */
function beginForms() {
  let plan = "";
  const form = (/** @type {string} */ id, /** @type {(query: URLSearchParams) => void} */ act) => {
    const found = /** @type {HTMLFormElement} */ (byId(id));
    found.addEventListener("submit", (event) => {
      event.preventDefault();
      refuse("");
      act(asked(found));
    });
  };
  form("table-form", async (query) => {
    const found = await work(`/positioning/table/${encodeURIComponent(shownId)}?${query}`, "");
    if (found) byId("table-told").replaceChildren(...saidAndFile(found, `${query.get("control")}.txt`));
  });
  form("plan-form", async (query) => {
    const found = await work(`/positioning/plan?${query}`, "");
    if (!found) return;
    plan = found.file;
    byId("program-form").hidden = false;
    showMade(word("positioning-plan_title"), saidAndFile(found, "plan.json"));
  });
  form("program-form", async (query) => {
    const found = await work(`/positioning/program?${query}`, plan);
    if (found) showMade(word("positioning-program_title"), saidAndFile(found, "program.txt"));
  });
}

/** Sort what was dropped to the fields, and send a run. @param {HTMLFormElement} form @param {File[]} files */
async function drop(form, files) {
  const sorted = /** @type {Record<string, DataTransfer>} */ ({});
  const put = (/** @type {string} */ name, /** @type {File} */ file) => {
    (sorted[name] ??= new DataTransfer()).items.add(file);
  };
  refuse("");
  try {
    for (const file of files) {
      const kind = file.name.toLowerCase().match(/\.(toml|json)$/)?.[1];
      put(kind === "toml" ? (await readToml(file)).name : kind === "json" ? "plan" : "file", file);
    }
  } catch (error) {
    refuse(error instanceof TypeError ? word("positioning-no_answer") : String(
      error instanceof Error ? error.message : error));
    return;
  }
  for (const [name, { files: found }] of Object.entries(sorted)) {
    const input = /** @type {HTMLInputElement} */ (form.elements.namedItem(name));
    input.files = found;
    nameFile(input);
  }
  if (sorted.file) await send(form);
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
  const names = [...input.files ?? []].map((one) => one.name).join(", ");
  if (shown) shown.textContent = names || word("positioning-no_file");
}

/** @param {HTMLFormElement} form */
function begin(form) {
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
    void send(form);
  });
  byId("run-cancel").addEventListener("click", () => leaving.abort());
  for (const one of /** @type {NodeListOf<HTMLElement>} */ (form.querySelectorAll("[data-form]"))) {
    const name = one.dataset.form ?? "";
    const input = /** @type {HTMLInputElement} */ (form.elements.namedItem(name));
    const told = input.parentElement?.querySelector(".run-file-name");
    const kept = (/** @type {string} */ toml) => {
      input.value = "";
      nameFile(input);
      if (told && toml) told.textContent = word("positioning-form_used");
    };
    kept(tomlOf(name));
    one.addEventListener("click", () => {
      const title = word(FORM_TITLES[/** @type {keyof typeof FORM_TITLES} */ (name)]);
      openForm(name, title, input.files?.[0], kept).catch((error) => refuse(error.message));
    });
  }
  const area = /** @type {HTMLElement} */ (form.closest(".run"));
  document.addEventListener("dragover", (event) => {
    event.preventDefault();
    area.dataset.over = "yes";
  });
  document.addEventListener("dragleave", () => { area.dataset.over = "no"; });
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    area.dataset.over = "no";
    void drop(form, [...event.dataTransfer?.files ?? []]);
  });
  beginForms();
  byId("run-figures").addEventListener("click", () => choose(false));
  byId("run-report").addEventListener("click", () => choose(true));
  void list(true);
}

const form = document.getElementById("run-form");
if (form instanceof HTMLFormElement) begin(form);
