// @ts-check
// Head, limits and budget by form: kept and sent as the TOML that the commands read.

import { button, byId, inEnglish, say } from "../elements.js";
import { post } from "../page.js";
import { save, told } from "../room.js";
import { word } from "../words.js";

const BARE = /^(true|false|-?\d+([.,]\d+)?)$/;

/** @param {string} name @returns {HTMLDialogElement} */
const dialogOf = (name) => /** @type {HTMLDialogElement} */ (byId(`form-${name}`));

/** @param {string} name @returns {HTMLInputElement[]} */
const fieldsOf = (name) => [.../** @type {NodeListOf<HTMLInputElement>} */ (
  dialogOf(name).querySelectorAll("[name]"))];

/** The file that a form stands for; empty where nothing was filled in. @param {string} name */
export function tomlOf(name) {
  const tables = /** @type {Record<string, string[]>} */ ({});
  for (const { name: id, value, dataset } of fieldsOf(name)) {
    const [table, key] = id.split(".");
    const text = value.trim();
    const isBare = BARE.test(text) && (dataset.bare === "yes" || text === "true" || text === "false");
    if (text) {
      (tables[table] ??= []).push(
        `${key} = ${isBare ? text.replace(",", ".") : JSON.stringify(text)}\n`);
    }
  }
  return Object.entries(tables).map(([table, lines]) => `[${table}]\n${lines.join("")}`).join("\n");
}

/** What a TOML file states, and which form it fills; null where it was refused. @param {File} file */
export async function readToml(file) {
  const found = await told("/positioning/toml", await file.text());
  if (!found) return null;
  const stated = (/** @type {string} */ id) => found[id.split(".")[0]]?.[id.split(".")[1]];
  const hits = (/** @type {string} */ form) =>
    fieldsOf(form).filter(({ name }) => stated(name) !== undefined).length;
  const [name] = ["head", "limits", "budget"].sort((a, b) => hits(b) - hits(a));
  return { name: hits(name) ? name : "map", stated };
}

/**
 * Open a form; what it is closed with is kept.
 * @param {string} name @param {File | undefined} file what it begins with
 * @param {(toml: string) => void} onKept
 */
export async function openForm(name, file, onKept) {
  const [dialog, fields] = [dialogOf(name), fieldsOf(name)];
  const form = /** @type {HTMLFormElement} */ (dialog.querySelector("form"));
  const before = fields.map(({ value }) => value);
  const wrong = /** @type {HTMLElement} */ (dialog.querySelector(".wrong"));
  const state = (/** @type {string} */ text) => {
    say(wrong, text);
    wrong.hidden = text === "";
  };
  if (file) {
    const found = await readToml(file);
    if (!found) return;
    for (const one of fields) one.value = found.stated(one.name) ?? "";
  }
  const begun = fields.map(({ value }) => value);
  form.onclick = ({ target }) => {
    const { act = "" } = /** @type {HTMLElement} */ (target).dataset;
    if (act === "save") save(tomlOf(name), `${name}.toml`);
    if (act === "empty") for (const one of fields) one.value = "";
  };
  form.onsubmit = async (event) => {
    if (/** @type {HTMLButtonElement} */ (event.submitter)?.value !== "keep") return;
    event.preventDefault();
    const answer = await post(`/positioning/form/${name}`, tomlOf(name)).catch(() => null);
    if (answer?.ok) dialog.close("keep");
    else state(answer ? (await answer.json()).text : word("room-no_answer"));
  };
  dialog.onclose = () => {
    if (dialog.returnValue === "keep") return onKept(tomlOf(name));
    const isFilled = fields.some((one, k) => one.value !== begun[k]);
    if (isFilled && !confirm(word("positioning-form_drop"))) return dialog.showModal();
    fields.forEach((one, k) => { one.value = before[k]; });
  };
  state("");
  dialog.returnValue = "";
  dialog.showModal();
}

/** A text of a command with a way to keep its file. @param {{file: string, said: string}} found */
export function saidAndFile({ file, said }, /** @type {string} */ name) {
  const link = button(word("positioning-save_file", { name }), () => save(file, name));
  const text = inEnglish("pre", said);
  text.tabIndex = 0;
  return [link, text];
}
