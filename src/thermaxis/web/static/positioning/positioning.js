// @ts-check
// Send a measured run, and show what its evaluation says.

import { drawLevels, drawTrend } from "./charts.js";
import { openForm, readToml, saidAndFile, tomlOf } from "./forms.js";
import { facts, shownOf, trendOf } from "./result.js";
import { button, byId, made } from "../elements.js";
import { askedBy, download, onDrop, refuse, told, work } from "../room.js";
import { moment, word } from "../words.js";

/** @typedef {Record<string, any>} Result */

const NAME_CHARACTERS = 200;
const FORMS = ["head", "limits", "budget"];
const TABLES = [...FORMS, "plan", "map"];

/** The run that is shown. */
let shownId = "";
/** How often a run was sent or a kept one chosen: only the last choice is shown. */
let chosen = 0;
/** Whether what is said of how a run is read was sent with one: it does not hold for the next. */
let isReadingSent = false;

/** @param {string} kind */
const address = (kind) => `/positioning/${kind}/${encodeURIComponent(shownId)}`;

/** @param {Result} result */
function show(result) {
  shownId = result.id;
  byId("run-nothing").hidden = true;
  byId("run-made").hidden = true;
  byId("run-result").hidden = false;
  byId("run-name").textContent = result.name;
  byId("run-facts").textContent = facts(result);
  byId("run-shown").replaceChildren(...shownOf(result));
  byId("run-frame").removeAttribute("src");
  byId("table-told").replaceChildren();
  const axis = String(result.test.header.axis ?? "");
  fieldOf("table-form", "axis").value = /^[A-Z]\w{0,15}$/i.test(axis) ? axis : "";
  nameFile(fieldOf("run-form", "file"), result.name);
  void choose(false);
  const { top } = byId("run-result").getBoundingClientRect();
  if (top < 0 || top > innerHeight / 2) byId("run-result").scrollIntoView();
  drawLevels(byId("run-levels"), byId("run-spread"), result);
}

/** @param {string} form @param {string} name @returns {HTMLInputElement} */
const fieldOf = (form, name) => /** @type {HTMLInputElement} */ (
  /** @type {HTMLFormElement} */ (byId(form)).elements.namedItem(name));

/** @param {boolean} report */
async function choose(report) {
  const frame = /** @type {HTMLIFrameElement} */ (byId("run-frame"));
  if (report && !frame.hasAttribute("src")) {
    const made = address("report");
    const text = await work(made, undefined, (answer) => answer.text());
    if (text === null || made !== address("report")) return;
    frame.src = made;
  }
  frame.hidden = !report;
  byId("run-shown").hidden = report;
  byId("run-charts").hidden = report;
  byId("run-report").setAttribute("aria-pressed", String(report));
  byId("run-figures").setAttribute("aria-pressed", String(!report));
}

// ---- asking -------------------------------------------------------------------------------------

/**
 * Address with the options, and what is sent: the runs and what goes along, one after another.
 * @param {HTMLFormElement} form
 */
function request(form) {
  const data = new FormData(form);
  const files = (/** @type {string} */ name) => /** @type {File[]} */ (data.getAll(name));
  const runs = files("file").filter(({ size }) => size > 0);
  const query = askedBy(form);
  for (const name of ["target_tolerance", "reference_time"]) {
    query.set(name, (query.get(name) ?? "").replace(",", "."));
  }
  query.set("no_drift", query.has("drift") ? "no" : "yes");
  const tables = TABLES.map((name) => {
    const [file] = files(name);
    const part = file.size > 0 || !FORMS.includes(name) ? file : new Blob([tomlOf(name)]);
    query.set(`${name}_bytes`, String(part.size));
    return part;
  });
  for (const run of runs) query.append("name", run.name.slice(-NAME_CHARACTERS));
  const none = files("file")[0].name ? "room-empty" : "positioning-file_first";
  if (runs.length < 2) {
    return { path: `/positioning/upload?${query}`, body: new Blob([...runs, ...tables]),
      lacking: runs.length ? "" : none };
  }
  for (const run of runs) query.append("bytes", String(run.size));
  return { path: `/positioning/trend?${query}`, lacking: "",
    body: new Blob([...runs, tables[TABLES.indexOf("map")]]) };
}

/** Take what was said of how the run before is read back; a new one may be another kind. */
function beginReading() {
  if (!isReadingSent) return;
  const fields = /** @type {NodeListOf<HTMLInputElement>} */ (
    byId("run-reading").querySelectorAll("[name]"));
  for (const one of fields) clear(one);
  isReadingSent = false;
}

/** @param {HTMLInputElement} input */
function clear(input) {
  input.value = "";
  nameFile(input);
}

/** Choose the run that is shown, where none is. */
async function chooseShown() {
  const input = fieldOf("run-form", "file");
  if (input.files?.length || byId("run-result").hidden) return;
  const run = await told(address("run"), undefined, (answer) => answer.blob());
  if (!run) return;
  const files = new DataTransfer();
  files.items.add(new File([run], byId("run-name").textContent ?? ""));
  input.files = files.files;
  nameFile(input);
}

/** @param {HTMLFormElement} form */
async function send(form) {
  await chooseShown();
  const reading = /** @type {HTMLDetailsElement} */ (byId("run-reading"));
  reading.open ||= [...reading.querySelectorAll("select, input")].some((one) =>
    /** @type {HTMLInputElement} */ (one).value); // what is not as in the file is seen
  isReadingSent = true;
  const { path, body, lacking } = request(form);
  const several = path.startsWith("/positioning/trend");
  const isLarge = body.size > (several ? 3 : 1) * Number(form.dataset.largest);
  chosen += 1;
  byId("run-result").hidden = true; // nobody takes an earlier run's figures for this one's
  if (lacking || isLarge) {
    const megabytes = Number(form.dataset.largest) / 1e6;
    refuse(word(lacking || "room-too_large", { megabytes }));
    return;
  }
  const found = await work(path, body);
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

/** Forms that ask for a file: table, plan and program. */
function beginForms() {
  let plan = "";
  const form = (/** @type {string} */ id, /** @type {(query: URLSearchParams) => void} */ act) => {
    const found = /** @type {HTMLFormElement} */ (byId(id));
    found.addEventListener("submit", (event) => {
      event.preventDefault();
      act(askedBy(found));
    });
  };
  form("table-form", async (query) => {
    if (!query.get("axis")) return refuse(word("positioning-axis_first"));
    const found = await work(`${address("table")}?${query}`, "");
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
  refuse("");
  for (const file of files) {
    const kind = file.name.toLowerCase().match(/\.(toml|json)$/)?.[1];
    const stated = kind === "toml" ? await readToml(file) : { name: kind ? "plan" : "file" };
    if (!stated) return;
    (sorted[stated.name] ??= new DataTransfer()).items.add(file);
  }
  if (sorted.file) beginReading();
  if (sorted.map) isReadingSent = false;
  for (const [name, { files: found }] of Object.entries(sorted)) {
    const input = fieldOf("run-form", name);
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
  const found = await told(`/positioning/result/${encodeURIComponent(id)}`, undefined, undefined,
    undefined, (text) => { if (mine === chosen) refuse(text); });
  if (mine !== chosen) return;
  if (found) return show(found);
  byId("run-result").hidden = true;
  await list(false);
}

/** @param {boolean} first */
async function list(first) {
  const answer = await told("/positioning/results", undefined, undefined, undefined,
    first ? refuse : () => {}); // later what was just said stays, and so does the list
  if (!answer) return;
  const found = /** @type {Result[]} */ (answer.results);
  byId("run-kept").replaceChildren(...found.map((one) => made("li", "", "",
    button(`${one.name} · ${moment(one.at)}`, () => {
      clear(fieldOf("run-form", "file"));
      void open(one.id);
    }))));
  if (first && chosen === 0 && found.length > 0) await open(found[0].id);
}

/** @param {HTMLInputElement} input @param {string} [none] what is said where none is chosen */
function nameFile(input, none = word("positioning-no_file")) {
  const shown = input.parentElement?.querySelector(".room-file-name");
  const names = [...input.files ?? []].map((one) => one.name).join(", ");
  if (shown) shown.textContent = names || none;
}

/** Name what a form is filled with beside its file. @param {string} name @param {string} toml */
function nameForm(name, toml) {
  const input = fieldOf("run-form", name);
  input.value = "";
  nameFile(input, word(toml ? "positioning-form_used" : "positioning-no_file"));
}

/** @param {HTMLFormElement} form */
function begin(form) {
  const room = /** @type {HTMLElement} */ (form.closest(".room"));
  const files = /** @type {NodeListOf<HTMLInputElement>} */ (form.querySelectorAll("input[type=file]"));
  for (const input of files) {
    input.addEventListener("change", () => {
      nameFile(input);
      if (input.name === "file") beginReading();
    });
    if (FORMS.includes(input.name)) nameForm(input.name, tomlOf(input.name));
    else nameFile(input);
  }
  byId("run-reading").addEventListener("change", () => { isReadingSent = false; });
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    void send(form);
  });
  room.addEventListener("click", ({ target }) => {
    const { clear: name, form: asked, kind } = /** @type {HTMLElement} */ (target).dataset;
    if (name) clear(fieldOf("run-form", name));
    if (kind) void download(address(kind));
    if (!asked) return;
    void openForm(asked, fieldOf("run-form", asked).files?.[0], (toml) => {
      nameForm(asked, toml);
      if (!byId("run-result").hidden) void send(form); // what is shown, with what was filled in
    });
  });
  onDrop(room, (dropped) => drop(form, dropped));
  beginForms();
  byId("run-figures").addEventListener("click", () => void choose(false));
  byId("run-report").addEventListener("click", () => void choose(true));
  void list(true);
}

const form = document.getElementById("run-form");
if (form instanceof HTMLFormElement) begin(form);
