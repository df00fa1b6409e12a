// @ts-check
// What rooms for dropped files share: work with its step, refusals, files to take along, tables.

import { byId, made, say } from "./elements.js";
import { post } from "./page.js";
import { duration, number, word } from "./words.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */

const LOOK_MS = 500;
const KEPT_MS = 60_000;
const STEPS = ["reading", "checking", "identifying", "simulating", "joining", "report"];
const room = document.body.dataset.page;

/** Ends the command that runs. @type {AbortController | null} */
let running = null;

/** A text with the signs of units, and options of commands called as the fields of the page that they are.
 * @param {string} text @param {HTMLElement[]} fields those that are named are added */
export function inOwnWords(text, fields = []) {
  const signed = text.replace(/\bdegC\b/g, "°C").replace(/(?<=\d\s?)um\b/g, "µm");
  return signed.replace(/--([a-z]+(?:-[a-z]+)*)/g, (option, name) => {
    const wanted = `[name=${name.replaceAll("-", "_")}]`;
    const field = /** @type {HTMLInputElement | null} */ (
      document.querySelector(`main details[open] ${wanted}`) ?? document.querySelector(`main ${wanted}`));
    const [label] = field?.labels ?? [];
    if (!field || !label) return option;
    fields.push(field);
    const own = [...label.childNodes].filter((one) => one.nodeType === Node.TEXT_NODE);
    return word("room-field", { name: own.map((one) => one.textContent?.trim()).join("") });
  });
}

/** Say what is wrong, or that nothing is any more; the first field that is named is shown.
 * @param {string} text */
export function refuse(text) {
  const fields = /** @type {HTMLElement[]} */ ([]);
  const wrong = byId("wrong");
  say(wrong, inOwnWords(text, fields));
  wrong.hidden = text === "";
  if (text) wrong.scrollIntoView({ block: "center" });
  fields[0]?.closest("details")?.setAttribute("open", "");
  fields[0]?.focus();
}

/**
 * Ask the server, and show its refusal.
 * @param {string} path
 * @param {unknown} [body] none: what is there
 * @param {(answer: Response) => Promise<any>} [read]
 * @param {AbortSignal} [signal]
 * @param {(text: string) => void} [onRefused]
 * @returns {Promise<any>} null where it was refused in words
 */
export async function told(path, body, read = (answer) => answer.json(), signal = undefined,
  onRefused = refuse) {
  try {
    const answer = await (body === undefined ? fetch(path, { signal }) : post(path, body, signal));
    if (answer.ok) return await read(answer);
    onRefused(String((await answer.json()).text ?? word("room-no_answer")));
  } catch {
    onRefused(word(signal?.aborted ? "room-cancelled" : "room-no_answer"));
  }
  return null;
}

/**
 * The same of what takes its time: its step is shown, and it can be given up.
 * @param {string} path @param {unknown} [body] @param {(answer: Response) => Promise<any>} [read]
 * @returns {Promise<any>}
 */
export async function work(path, body, read) {
  if (running) { // one at a time
    refuse(word("room-own"));
    return null;
  }
  refuse("");
  running = new AbortController();
  const [begunMs, focused] = [performance.now(), /** @type {HTMLElement} */ (document.activeElement)];
  const tell = (/** @type {string} */ at) => {
    const step = STEPS.find((one) => at.startsWith(one)) ?? "waiting";
    const since = duration((performance.now() - begunMs) / 1000);
    say(byId("step"), `${word(`room-step_${step}`)} ${since}`);
  };
  const progress = () => fetch(`/${room}/progress`).then((one) => one.json()).catch(() => ({}));
  const look = async () => tell(String((await progress()).step ?? ""));
  const isHeld = async () => (await progress()).held === true;
  const buttons = /** @type {NodeListOf<HTMLButtonElement>} */ (
    document.querySelectorAll("main button.main"));
  for (const one of buttons) one.disabled = true;
  tell("");
  byId("work").hidden = false;
  const timer = setInterval(() => void look(), LOOK_MS);
  const found = await told(path, body, read, running.signal);
  while (running.signal.aborted && await isHeld()) { // until its place is free for what comes next
    await new Promise((resolve) => { setTimeout(resolve, LOOK_MS / 5); });
  }
  clearInterval(timer);
  running = null;
  byId("work").hidden = true;
  for (const one of buttons) one.disabled = false;
  if (document.activeElement === document.body) focused.focus();
  return found;
}

/** Take along a file that the server makes, under the name that it has there. @param {string} address */
export async function download(address) {
  const answer = await work(address, undefined, async (found) => ({
    content: await found.blob(), head: found.headers.get("Content-Disposition") ?? "",
  }));
  if (!answer) return;
  const [, letters, plain = "file"] = /filename\*=utf-8''(.*)|filename="(.*)"/i.exec(answer.head) ?? [];
  save(answer.content, letters ? decodeURIComponent(letters) : plain);
}

/** Offer a text or content as a file. @param {BlobPart} content @param {string} name */
export function save(content, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([content]));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), KEPT_MS);
}

/** Take files dropped anywhere. @param {HTMLElement} shown @param {(files: File[]) => unknown} act */
export function onDrop(shown, act) {
  for (const name of ["dragover", "dragleave", "drop"]) {
    document.addEventListener(name, (event) => {
      event.preventDefault();
      shown.dataset.over = name === "dragover" ? "yes" : "no";
      if (name === "drop") act([.../** @type {DragEvent} */ (event).dataTransfer?.files ?? []]);
    });
  }
}

/** What a form asks, flags as "yes". @param {HTMLFormElement} form */
export function askedBy(form) {
  const texts = [...new FormData(form)].filter(([, value]) => typeof value === "string");
  return new URLSearchParams(texts.map(([name, value]) =>
    [name, value === "on" ? "yes" : String(value).trim()]));
}

/**
 * A table that can be scrolled sideways, also by keyboard.
 * @param {string} label @param {string[]} head numbers from the second column on
 * @param {HTMLElement[][]} rows
 */
export function tableOf(label, head, rows) {
  const cells = head.map((text, k) => {
    const cell = /** @type {HTMLTableCellElement} */ (made("th", text, k ? "number" : ""));
    cell.scope = "col";
    return cell;
  });
  const rowOf = (/** @type {HTMLElement[]} */ row) => made("tr", "", "", ...row);
  const scroll = made("div", "", "room-scroll", made("table", "", "",
    made("thead", "", "", rowOf(cells)), made("tbody", "", "", ...rows.map(rowOf))));
  scroll.tabIndex = 0;
  scroll.setAttribute("role", "group");
  scroll.setAttribute("aria-label", label);
  return scroll;
}

/** Head of a row. @param {(Node | string)[]} inner */
export function titleCell(...inner) {
  const cell = /** @type {HTMLTableCellElement} */ (made("th", "", "", ...inner));
  cell.scope = "row";
  return cell;
}

/** Numbers, with all of their digits beside. @param {any} value one or several @param {number} digits */
export function numberCell(value, digits) {
  const values = [value].flat();
  const cell = made("td", values.map((one) => number(one, digits)).join("; "), "number");
  cell.dataset.value = values.map((one) => String(one ?? "")).join(" ");
  return cell;
}

/** A list of texts or elements below a title; nothing where it is empty.
 * @param {string} title @param {(string | HTMLElement)[]} rows @returns {HTMLElement[]} */
export function listed(title, rows) {
  if (!rows.length) return [];
  return section(title, made("ul", "", "", ...rows.map((one) =>
    typeof one === "string" ? made("li", inOwnWords(one)) : one)));
}

/** @param {string} title @param {HTMLElement[]} content @returns {HTMLElement[]} */
export function section(title, ...content) {
  return [made("section", "", "", made("h3", title), ...content)];
}

document.getElementById("cancel")?.addEventListener("click", () => running?.abort());
