// @ts-check
// What rooms for dropped files share: work with its step, refusals, files to take along, tables.

import { byId, made, say } from "./elements.js";
import { duration, number, word } from "./words.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */

const LOOK_MS = 500;
const KEPT_MS = 60_000;
const STEPS = ["reading", "checking", "identifying", "simulating", "joining", "report"];
const room = document.body.dataset.page;

/** Ends the command that runs. @type {AbortController | null} */
let running = null;

/** Say what is wrong, or that nothing is any more. @param {string} text */
export function refuse(text) {
  const wrong = byId("wrong");
  say(wrong, text);
  wrong.hidden = text === "";
  if (text) wrong.scrollIntoView({ block: "center" });
}

/**
 * Ask for work that takes its time: its step is shown, and it can be given up.
 * @template T
 * @param {(signal: AbortSignal) => Promise<Response>} ask
 * @param {(answer: Response) => Promise<T>} take
 * @returns {Promise<T | null>} null where it was refused in words
 */
export async function work(ask, take) {
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
  const look = async () => {
    const answer = await fetch(`/${room}/progress`).catch(() => null);
    tell(answer?.ok ? String((await answer.json()).step ?? "") : "");
  };
  const buttons = /** @type {NodeListOf<HTMLButtonElement>} */ (
    document.querySelectorAll("main button.main"));
  for (const one of buttons) one.disabled = true;
  tell("");
  byId("work").hidden = false;
  const timer = setInterval(() => void look(), LOOK_MS);
  try {
    const answer = await ask(running.signal);
    if (answer.ok) return await take(answer);
    refuse(String((await answer.json()).text ?? word("room-no_answer")));
  } catch {
    refuse(word(running.signal.aborted ? "room-cancelled" : "room-no_answer"));
  } finally {
    clearInterval(timer);
    running = null;
    byId("work").hidden = true;
    for (const one of buttons) one.disabled = false;
    if (document.activeElement === document.body) focused.focus();
  }
  return null;
}

/** Take along a file that the server makes, under the name that it has there. @param {string} address */
export async function download(address) {
  const answer = await work((signal) => fetch(address, { signal }), async (found) => ({
    content: await found.blob(), head: found.headers.get("Content-Disposition") ?? "",
  }));
  if (answer) save(answer.content, /filename="(.*)"/.exec(answer.head)?.[1] ?? "file");
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
    typeof one === "string" ? made("li", one) : one)));
}

/** @param {string} title @param {HTMLElement[]} content @returns {HTMLElement[]} */
export function section(title, ...content) {
  return [made("section", "", "", made("h3", title), ...content)];
}

document.getElementById("cancel")?.addEventListener("click", () => running?.abort());
