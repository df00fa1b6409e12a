// @ts-check
// Logs on the bench: dropped, a model identified from some, verified on others.

import { button, byId, made } from "../elements.js";
import { onDrop, refuse, told, work } from "../room.js";
import { word } from "../words.js";
import { cardOf } from "./result.js";

/** @typedef {import("../room.js").Data} Data */

const largest = Number(byId("drop").dataset.largest);
const form = {
  identify: /** @type {HTMLFormElement} */ (byId("identify")),
  verify: /** @type {HTMLFormElement} */ (byId("verify")),
  reading: /** @type {HTMLFormElement} */ (byId("reading-form")),
};
const cards = /** @type {Map<string, HTMLElement>} */ (new Map());
const chosen = /** @type {Map<string, HTMLInputElement>} */ (new Map()); // logs, by id
let entries = /** @type {Data[]} */ ([]);
let asked = ""; // the log that the form is about
let mapping = new Blob([]); // what the columns of the logs hold, as a file says it
const units = /** @type {Map<string, string>} */ (new Map()); // stated here, by channel
let unread = /** @type {File[]} */ ([]); // what was refused, and what came with it

// ---- what is there ------------------------------------------------------------------------------

/** @param {string} [latest] entry that is shown first */
async function refresh(latest = "") {
  const bench = await told("/thermal/bench");
  if (!bench) return;
  entries = bench.entries;
  for (const [id, card] of cards) {
    if (entries.some((one) => one.id === id)) continue;
    card.remove();
    cards.delete(id);
    chosen.delete(id);
  }
  for (const entry of entries) {
    if (cards.has(entry.id)) continue;
    const card = cardOf(entry, entries, remove);
    cards.set(entry.id, card);
    byId("results").prepend(card);
  }
  byId("nothing").hidden = entries.length > 0;
  listLogs();
  askModel();
  askVerification();
  const heading = cards.get(latest)?.querySelector("h2");
  heading?.focus();
  heading?.scrollIntoView({ block: "nearest" });
}

/** @param {string} kind */
const all = (kind) => entries.filter((one) => one.kind === kind);
const used = () => all("log").filter(({ id }) => chosen.get(id)?.checked);

/** @param {Data} entry */
async function remove(entry) {
  const isUsed = entries.some(({ made_of }) => made_of.includes(entry.id));
  if (isUsed && !confirm(word("thermal-remove_all", { name: entry.name }))) return;
  await work("/thermal/remove", { id: entry.id });
  await refresh();
}

function listLogs() {
  const logs = all("log");
  for (const { id } of logs) {
    if (chosen.has(id)) continue;
    chosen.set(id, checkBox("", chosen.size === 0));
    chosen.get(id)?.addEventListener("change", askModel);
  }
  byId("logs").replaceChildren(...logs.map((log) => made("li", "", "",
    made("label", "", "room-check", /** @type {Node} */ (chosen.get(log.id)), log.name),
    button("✕", () => void remove(log), word("thermal-remove", { name: log.name })))));
}

// ---- forms --------------------------------------------------------------------------------------

/** A box of the outputs, or of none. @param {string} value @param {boolean} checked */
function checkBox(value, checked) {
  const box = /** @type {HTMLInputElement} */ (made("input"));
  Object.assign(box, { type: "checkbox", name: value && "output", value, checked });
  return box;
}

/** @param {string[]} values @param {string} chosenOne @param {string} label */
function select(values, chosenOne, label) {
  const found = /** @type {HTMLSelectElement} */ (made("select"));
  found.append(...values.map((one) => new Option(one || "–", one, false, one === chosenOne)));
  found.setAttribute("aria-label", label);
  return found;
}

/** Offer the channels of the first log that is chosen. */
function askModel() {
  const [log] = used();
  byId("join").hidden = used().length !== 2;
  form.identify.hidden = !log;
  if (!log || log.id === asked) return;
  asked = log.id;
  const { channels, suggested_inputs: inputs } = log.told.logs[0];
  byId("units").replaceChildren(...channels
    .filter((/** @type {Data} */ { name, unit }) => !unit || units.has(name))
    .map((/** @type {Data} */ { name }) => {
      const title = word("thermal-unit_of", { name });
      const unit = select(["", "degC", "degF", "K", "um", "mm", "rpm"], units.get(name) ?? "", title);
      unit.name = `[${name}`;
      return made("label", title, "", unit);
    }));
  const lengths = channels.filter((/** @type {Data} */ one) => one.quantity === "displacement");
  byId("outputs").replaceChildren(...lengths.map((/** @type {Data} */ one, /** @type {number} */ k) =>
    made("label", "", "room-check", checkBox(one.name, k === 0), one.name)), ...(lengths.length ? [] : [made("p", word("thermal-no_displacement"), "wrong")]));
  byId("inputs").replaceChildren(...inputs.map(inputRow),
    ...(inputs.length ? [] : [made("p", word("thermal-no_temperature"), "wrong")]));
}

/** @param {Data} [input] */
function inputRow(input = {}) {
  const log = all("log").find(({ id }) => id === asked);
  const channels = /** @type {Data[]} */ (log?.told.logs[0].channels ?? []);
  const names = channels.filter((one) => one.quantity !== "displacement")
    .sort((a, b) => Number(b.quantity === "temperature") - Number(a.quantity === "temperature"))
    .map((one) => one.name);
  const plus = select(names, input.plus ?? "", word("thermal-input"));
  const minus = select(["", ...names], input.minus ?? "", word("thermal-minus"));
  const row = made("div", "", "bench-input", plus, "−", minus,
    button("✕", () => row.remove(), word("thermal-remove", { name: plus.value })));
  row.dataset.name = input.name ?? "";
  row.dataset.plus = input.plus ?? "";
  return row;
}

function askVerification() {
  const [models, logs] = [all("model"), all("log")];
  const [model, log] = /** @type {HTMLSelectElement[]} */ (
    ["model", "log"].map((name) => form.verify.elements.namedItem(name)));
  const options = (/** @type {Data[]} */ list) => list.map(({ id, name }) => new Option(name, id));
  model.replaceChildren(...options([...models].reverse()));
  const offer = () => {
    const { made_of = [], told = {} } = models.find(({ id }) => id === model.value) ?? {};
    const others = logs.filter(({ id, told: { logs: [log] } }) =>
      !made_of.includes(id) && !told.trained_on?.includes(log.sha256)).reverse();
    log.replaceChildren(...options(others));
    byId("verify-none").hidden = others.length > 0;
  };
  model.onchange = offer;
  offer();
  form.verify.hidden = models.length === 0;
  byId("compare").hidden = models.length < 2;
}

/** @param {Promise<Data | null>} made */
async function show(made) {
  const found = await made;
  if (found) await refresh(found.id);
}

async function identify() {
  const data = new FormData(form.identify);
  const inputs = /** @type {HTMLElement[]} */ ([...byId("inputs").querySelectorAll(".bench-input")])
    .map((row) => {
      const [plus, minus] = [...row.querySelectorAll("select")].map((one) => one.value);
      return { name: plus === row.dataset.plus ? row.dataset.name : plus, plus, minus };
    });
  const outputs = data.getAll("output");
  if (!outputs.length) return refuse(word("thermal-output_first"));
  if (!inputs.length) return refuse(word("thermal-input_first"));
  return show(work("/thermal/identify", {
    logs: used().map(({ id }) => id), outputs, inputs, choose: data.has("choose"),
    method: data.get("method"), sample_time: String(data.get("sample_time")).replace(",", "."),
  }));
}

/** @param {string} path @param {(data: FormData) => Data} body */
async function judge(path, body) {
  const data = new FormData(form.verify);
  if (!data.get("log")) return refuse(word("thermal-verify_another"));
  return show(work(`/thermal/${path}`, { logs: [data.get("log")], ...body(data) }));
}

// ---- files --------------------------------------------------------------------------------------

/** What is stated here of how logs are read, as a mapping states it.
 * @param {boolean} again whether of the log that the form is about, with its channels */
function statedOf(again) {
  const said = (/** @type {string} */ name, /** @type {unknown} */ value) =>
    value ? `${name} = ${JSON.stringify(value)}\n` : "";
  const data = new FormData(form.reading);
  const time = ["date_order", "unit", "format"].map((one) => said(one, data.get(one))).join("");
  const channels = again ? [...data].filter(([name, unit]) => unit && name.startsWith("[")) : [];
  const columns = channels.map(([name, unit]) => {
    units.set(name.slice(1), String(unit));
    return `[columns.${JSON.stringify(name.slice(1))}]\n${said("unit", unit)}`;
  }).join("");
  return new Blob(time || columns ? [`[time]\n${time}${columns}`] : []);
}

/** Take logs, saved models, and a mapping; return the last one's name. @param {File[]} files */
async function add(files, again = false) {
  mapping = files.find(({ name }) => name.toLowerCase().endsWith(".toml")) ?? mapping;
  const wanted = files.filter((one) => one !== mapping);
  unread = [];
  for (const [k, file] of wanted.entries()) {
    const stated = statedOf(again);
    const query = new URLSearchParams({ name: file.name.slice(-200),
      map_bytes: String(mapping.size), stated_bytes: String(stated.size) });
    const found = file.size > largest
      ? refuse(word("room-too_large", { megabytes: largest / 1e6 }))
      : await work(`/thermal/log?${query}`, new Blob([file, mapping, stated]));
    if (!found) {
      unread = wanted.slice(k);
      byId("reading").setAttribute("open", "");
      return "";
    }
    await refresh(found.id);
    if (k === wanted.length - 1) return found.id;
  }
  return "";
}

/** Read what was refused again, or the log that the form is about, as is said now. */
async function readAgain() {
  const [log] = unread.length ? [] : used();
  const content = log && await told(`/thermal/log/${log.id}`, undefined, (one) => one.blob());
  const id = await add(content ? [new File([content], log.name)] : unread, Boolean(log));
  if (!id) return;
  for (const [key, box] of chosen) box.checked ||= key === id;
  if (log) await remove(log);
  askModel();
}

const files = /** @type {HTMLInputElement} */ (byId("files"));
files.addEventListener("change", () => void add([...(files.files ?? [])])
  .then(() => { files.value = ""; }));
onDrop(/** @type {HTMLElement} */ (document.querySelector(".room")), add);
for (const [name, act] of /** @type {const} */ ([
  ["identify", identify],
  ["reading", readAgain],
  ["verify", () => judge("verify", (data) => ({ model: data.get("model") }))],
])) {
  form[name].addEventListener("submit", (event) => {
    event.preventDefault();
    void act();
  });
}
byId("compare").addEventListener("click", () => void judge("compare", (data) => {
  const outputs = (/** @type {Data} */ one) => Object.keys(one.told.outputs).sort().join();
  const alike = all("model").filter(({ id }) => id === data.get("model")).map(outputs);
  const models = all("model").filter((one) => alike.includes(outputs(one)));
  return { models: models.map(({ id }) => id) };
}));
byId("join").addEventListener("submit", (event) => {
  event.preventDefault();
  const shift = String(new FormData(/** @type {HTMLFormElement} */ (event.target)).get("shift"));
  void show(work("/thermal/join",
    { logs: used().map(({ id }) => id), shift: shift.trim().replace(",", ".") }));
});
byId("input-add").addEventListener("click", () => {
  const row = inputRow();
  byId("inputs").append(row);
  row.querySelector("select")?.focus();
});
void refresh();
