// @ts-check
// Logs on the bench: dropped, a model identified from some, verified on others.

import { button, byId, made, say } from "../elements.js";
import { post } from "../page.js";
import { duration, word } from "../words.js";
import { cardOf } from "./result.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */

const LOOK_MS = 500;
const STEPS = /** @type {Record<string, string>} */ ({
  reading: "thermal-step_reading", "checking sensors": "thermal-step_checking",
  identifying: "thermal-step_identifying", simulating: "thermal-step_simulating",
  joining: "thermal-step_joining", report: "thermal-step_report",
});
const largest = Number(byId("drop").dataset.largest);
const form = {
  identify: /** @type {HTMLFormElement} */ (byId("identify")),
  verify: /** @type {HTMLFormElement} */ (byId("verify")),
};
const cards = /** @type {Map<string, HTMLElement>} */ (new Map());
const chosen = /** @type {Map<string, HTMLInputElement>} */ (new Map()); // logs, by id
let entries = /** @type {Data[]} */ ([]);
let running = /** @type {AbortController | null} */ (null);
let asked = ""; // the log that the form is about

// ---- asking -------------------------------------------------------------------------------------

/** @param {string} text */
function refuse(text) {
  const wrong = byId("wrong");
  say(wrong, text);
  wrong.hidden = text === "";
  if (text) wrong.scrollIntoView({ block: "center" });
}

/**
 * Ask for work that takes its time: its step is shown, and it can be cancelled.
 * @template T
 * @param {(signal: AbortSignal) => Promise<Response>} ask
 * @param {(answer: Response) => Promise<T>} take
 * @returns {Promise<T | null>}
 */
async function work(ask, take) {
  if (running) return null; // one at a time
  refuse("");
  running = new AbortController();
  const begunMs = performance.now();
  const tell = async () => {
    const answer = await fetch("/thermal/progress").catch(() => null);
    const told = answer?.ok ? await answer.json() : {};
    const known = Object.keys(STEPS).find((one) => String(told.step ?? "").startsWith(one));
    const step = word(known ? STEPS[known] : "thermal-step_waiting");
    say(byId("step"), `${step} ${duration((performance.now() - begunMs) / 1000)}`);
  };
  say(byId("step"), word("thermal-step_waiting"));
  byId("work").hidden = false;
  const timer = setInterval(() => void tell(), LOOK_MS);
  try {
    const answer = await ask(running.signal);
    if (answer.ok) return await take(answer);
    refuse(String((await answer.json()).text ?? word("positioning-no_answer")));
  } catch {
    refuse(word(running.signal.aborted ? "thermal-cancelled" : "positioning-no_answer"));
  } finally {
    clearInterval(timer);
    running = null;
    byId("work").hidden = true;
  }
  return null;
}

/** @param {string} path @param {unknown} body @returns {Promise<Data | null>} */
async function ask(path, body, asIs = false) {
  return work((signal) => post(`/thermal/${path}`, body, asIs, signal), (answer) => answer.json());
}

/** Take a file along. @param {Data} entry @param {string} name */
async function download(entry, name) {
  const content = await work((signal) => fetch(`/thermal/file/${entry.id}/${name}`, { signal }),
    (answer) => answer.blob());
  if (!content) return;
  const link = /** @type {HTMLAnchorElement} */ (made("a"));
  link.href = URL.createObjectURL(content);
  link.download = `${entry.name}-${name}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

// ---- what is there ------------------------------------------------------------------------------

/** @param {string} [latest] entry that is shown first */
async function refresh(latest = "") {
  const answer = await fetch("/thermal/bench").catch(() => null);
  if (!answer?.ok) return refuse(word("positioning-no_answer"));
  entries = (await answer.json()).entries;
  for (const [id, card] of cards) {
    if (entries.some((one) => one.id === id)) continue;
    card.remove();
    cards.delete(id);
    chosen.delete(id);
  }
  for (const entry of entries) {
    if (cards.has(entry.id)) continue;
    const card = cardOf(entry, entries, { ask, download, remove });
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
  await ask("remove", { id: entry.id });
  await refresh();
}

function listLogs() {
  const logs = all("log");
  for (const { id } of logs) {
    if (chosen.has(id)) continue;
    const box = /** @type {HTMLInputElement} */ (made("input"));
    box.type = "checkbox";
    box.checked = chosen.size === 0;
    box.addEventListener("change", askModel);
    chosen.set(id, box);
  }
  byId("logs").replaceChildren(...logs.map((log) => made("li", "", "",
    made("label", "", "bench-check", /** @type {Node} */ (chosen.get(log.id)), log.name),
    button("✕", () => void remove(log), word("thermal-remove", { name: log.name })))));
}

// ---- forms --------------------------------------------------------------------------------------

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
  const lengths = channels.filter((/** @type {Data} */ one) => one.quantity === "displacement");
  byId("outputs").replaceChildren(...lengths.map((/** @type {Data} */ one, /** @type {number} */ k) => {
    const box = /** @type {HTMLInputElement} */ (made("input"));
    [box.type, box.name, box.value, box.checked] = ["checkbox", "output", one.name, k === 0];
    return made("label", "", "bench-check", box, one.name);
  }), ...(lengths.length ? [] : [made("p", word("thermal-no_displacement"), "wrong")]));
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
    const made_of = models.find(({ id }) => id === model.value)?.made_of ?? [];
    const others = logs.filter(({ id }) => !made_of.includes(id)).reverse();
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
  return show(ask("identify", {
    logs: used().map(({ id }) => id), outputs, inputs, choose: data.has("choose"),
    method: data.get("method"), sample_time: String(data.get("sample_time")).replace(",", "."),
  }));
}

/** @param {string} path @param {(data: FormData) => Data} body */
async function judge(path, body) {
  const data = new FormData(form.verify);
  if (!data.get("log")) return refuse(word("thermal-verify_another"));
  return show(ask(path, { logs: [data.get("log")], ...body(data) }));
}

/** @param {Iterable<File>} files */
async function add(files) {
  for (const file of files) {
    if (file.size > largest) refuse(word("thermal-too_large"));
    else {
      const query = new URLSearchParams({ name: file.name.slice(-200) });
      const found = await ask(`log?${query}`, file, true);
      if (!found) return;
      await refresh(found.id);
    }
  }
}

const files = /** @type {HTMLInputElement} */ (byId("files"));
files.addEventListener("change", () => void add([...(files.files ?? [])])
  .then(() => { files.value = ""; }));
for (const name of ["dragover", "dragleave", "drop"]) {
  document.addEventListener(name, (event) => {
    event.preventDefault();
    byId("drop").dataset.over = name === "dragover" ? "yes" : "no";
    if (name === "drop") void add([...(/** @type {DragEvent} */ (event).dataTransfer?.files ?? [])]);
  });
}
for (const [name, act] of /** @type {const} */ ([
  ["identify", identify],
  ["verify", () => judge("verify", (data) => ({ model: data.get("model") }))],
])) {
  form[name].addEventListener("submit", (event) => {
    event.preventDefault();
    void act();
  });
}
byId("compare").addEventListener("click", () =>
  void judge("compare", () => ({ models: all("model").map(({ id }) => id) })));
byId("join").addEventListener("click", () =>
  void show(ask("join", { logs: used().map(({ id }) => id) })));
byId("input-add").addEventListener("click", () => {
  const row = inputRow();
  byId("inputs").append(row);
  row.querySelector("select")?.focus();
});
byId("cancel").addEventListener("click", () => running?.abort());
void refresh();
