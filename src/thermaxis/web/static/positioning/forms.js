// @ts-check
// Head, limits and budget by form: kept by the browser, sent as the TOML that the commands read.

import { byId, inEnglish, made } from "../elements.js";
import { post } from "../page.js";
import { word } from "../words.js";

/** @typedef {{key: string, label: string, unit: string, needed?: boolean, choices?: string[]}} Field */
/** @typedef {{table: string, title: string, fields: Field[]}} Group */
/** @typedef {Record<string, Record<string, string>>} Values */

const BOOLEAN = /^(true|false)$/;
const NUMBER = /^-?\d+([.,]\d+)?$/;
const forms = /** @type {Record<string, Group[]>} */ (
  JSON.parse(document.getElementById("forms")?.textContent ?? "{}"));

/** @param {string} name @returns {Values} */
function kept(name) {
  try {
    return JSON.parse(localStorage.getItem(`axis-${name}`) ?? "{}");
  } catch {
    return {}; // a browser that keeps nothing
  }
}

/**
 * The file that a form stands for; empty where nothing was filled in.
 * @param {string} name @param {Values} [values]
 */
export function tomlOf(name, values = kept(name)) {
  const parts = (forms[name] ?? []).map(({ table, fields }) => {
    const lines = fields.filter(({ key }) => values[table]?.[key]).map(({ key, unit }) => {
      const text = values[table][key];
      const isBare = BOOLEAN.test(text) || (NUMBER.test(text) && (unit || name !== "head"));
      return `${key} = ${isBare ? text.replace(",", ".") : JSON.stringify(text)}\n`;
    });
    return lines.length ? `[${table}]\n${lines.join("")}` : "";
  });
  return parts.filter(Boolean).join("\n");
}

/** Which form a TOML file is of, and what it states. @param {File} file */
export async function readToml(file) {
  const answer = await post("/positioning/toml", await file.text(), true);
  const found = await answer.json();
  if (!answer.ok) throw new Error(found.text);
  const hits = (/** @type {string} */ name) => forms[name].flatMap(({ table, fields }) =>
    fields.filter(({ key }) => Object.hasOwn(found[table] ?? {}, key))).length;
  const [name] = Object.keys(forms).sort((a, b) => hits(b) - hits(a));
  return { name, values: /** @type {Values} */ (found) };
}

/** @param {Field} field @param {string} id @param {string} value */
function inputOf({ choices, label, unit, needed }, id, value) {
  const input = /** @type {HTMLInputElement} */ (made(choices ? "select" : "input"));
  for (const one of choices ? ["", ...choices] : []) input.append(new Option(one, one));
  input.name = id;
  input.value = value;
  const named = inEnglish("span", `${label}${unit ? ` [${unit}]` : ""}${needed ? " *" : ""}`);
  return made("label", "", "", named, input);
}

/**
 * Open a form; what it is closed with is kept.
 * @param {string} name @param {string} title @param {File | undefined} file what it begins with
 * @param {(toml: string) => void} onKept
 */
export async function openForm(name, title, file, onKept) {
  const dialog = /** @type {HTMLDialogElement} */ (byId("form-dialog"));
  const form = /** @type {HTMLFormElement} */ (dialog.querySelector("form"));
  const values = file ? (await readToml(file)).values : kept(name);
  byId("form-title").textContent = title;
  byId("form-fields").replaceChildren(...forms[name].map(({ table, title: of, fields }) =>
    made("fieldset", "", "", inEnglish("legend", of), ...fields.map((field) =>
      inputOf(field, `${table}.${field.key}`, values[table]?.[field.key] ?? "")))));
  const stated = () => {
    const found = /** @type {Values} */ ({});
    for (const [id, value] of new FormData(form)) {
      const [table, key] = id.split(".");
      if (String(value).trim()) (found[table] ??= {})[key] = String(value).trim();
    }
    return found;
  };
  byId("form-save").onclick = () => save(tomlOf(name, stated()), `${name}.toml`);
  byId("form-empty").onclick = () => {
    for (const one of form.querySelectorAll("input, select")) {
      /** @type {HTMLInputElement} */ (one).value = "";
    }
  };
  dialog.onclose = () => {
    if (dialog.returnValue !== "keep") return;
    const found = stated();
    try {
      localStorage.setItem(`axis-${name}`, JSON.stringify(found));
    } catch {
      // it is sent this time, and asked again the next
    }
    onKept(tomlOf(name, found));
  };
  dialog.returnValue = "";
  dialog.showModal();
}

/** Offer a text as a file. @param {string} text @param {string} name */
export function save(text, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text]));
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}

/** A text of a command with a way to keep its file. @param {{file: string, said: string}} found */
export function saidAndFile({ file, said }, /** @type {string} */ name) {
  const link = made("button", word("positioning-save_file", { name }), "main");
  link.addEventListener("click", () => save(file, name));
  const text = inEnglish("pre", said);
  text.tabIndex = 0;
  return [link, text];
}
