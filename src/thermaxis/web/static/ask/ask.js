// @ts-check
// How a page asks something of the loop: said in words before, confirmed by a person, then sent.
// A question without an answer is neither taken nor refused: it may still take effect.

import { button, byId, made, style } from "../elements.js";
import { post } from "../page.js";
import { latest } from "../live.js";
import { pageLanguage, word } from "../words.js";
import { begin, take, titleOf } from "./requests.js";

const LONGEST_MS = 60_000;
const LOOK_MS = 250;

/** @typedef {Record<string, any>} Status */
/** @typedef {import("./requests.js").Answer} Answer */

/**
 * @typedef {object} Wording
 * @property {(status: Status) => string[]} text what will happen, said anew with every status
 * @property {string | null} [sha256] hash of the model's file that is asked for
 * @property {(status: Status) => string} [blocked] why a status leaves nothing to ask for, such as
 *   after somebody else has asked for it; empty where it can be asked
 * @property {string[]} [blind] what is said in place of the text while there are no data; without
 *   it nothing can be asked then
 */

style("ask/ask.css");

/**
 * Ask, after a person has confirmed what will happen.
 * @param {string} method
 * @param {(string | number)[]} args
 * @param {Wording} wording
 * @returns {Promise<boolean>} whether it was accepted
 */
export async function ask(method, args, wording) {
  if (!(await confirmed(titleOf({ method, args }), wording))) return false;
  const request = begin(method, args, wording.sha256 ?? null);
  /** @type {Promise<Answer>} */
  const late = new Promise((go) => {
    setTimeout(go, LONGEST_MS, { kind: "unknown", reason: {} });
  });
  const answer = await Promise.race([answerOf(method, args), late]);
  take(request, answer);
  return answer.kind === "accepted";
}

/** @param {string} method @param {(string | number)[]} args @returns {Promise<Answer>} */
async function answerOf(method, args) {
  try {
    const answer = await post("/ask", { method, arguments: args });
    const said = await answer.json().catch(() => null);
    if (answer.status >= 500 || said === null) return { kind: "unknown", reason: {} };
    if (!answer.ok) return { kind: "refused", reason: { [pageLanguage]: said.text ?? "" } };
    return { kind: said.answer, reason: said.reason };
  } catch (error) {
    if (!(error instanceof TypeError)) throw error;
    return { kind: "unknown", reason: { [pageLanguage]: word("operator-ask_unreached") } };
  }
}

/** Say what will happen, or why nothing can be asked.
 * @param {string} title also of the button that asks it @param {Wording} wording */
async function confirmed(title, wording) {
  const { body, show } = openDialog(title, { go: title });
  let told = "";
  return await show(() => {
    const status = latest();
    const blocked = status ? wording.blocked?.(status) : "";
    const why = blocked ? word("operator-nothing_to_ask", { why: blocked })
      : status || wording.blind ? "" : word("operator-why_no_data");
    const text = status ? wording.text(status) : wording.blind ?? [];
    const name = document.body.dataset.name ?? "";
    const lines = why ? [why] : [...text, word("operator-asks_under", { name })];
    if (told !== lines.join("\n")) {
      told = lines.join("\n");
      body.replaceChildren(...lines.map((line) => made("p", line, why ? "ask-wrong" : "")));
    }
    return !why;
  }) === "asked";
}

/**
 * Make a dialog. What shows it draws it at once, again and again and after every touch, which says
 * whether it can be gone on; it gives the value of the button that has closed it.
 * @param {string} title
 * @param {object} how
 * @param {string} [how.leave] text of the button that leaves it
 * @param {string} [how.go] text of the button that goes on; without it there is none
 * @param {string} [how.template] id of a template of what stands in it
 */
export function openDialog(title, { leave = word("common-cancel"), go = "", template = "" }) {
  const body = made("div", "", "ask-body");
  if (template) {
    const { content } = /** @type {HTMLTemplateElement} */ (byId(template));
    body.append(content.cloneNode(true));
  }
  const off = button(leave, () => dialog.close());
  off.autofocus = !template;
  const on = /** @type {HTMLButtonElement} */ (made("button", go, "main"));
  on.value = "asked";
  const buttons = made("div", "", "ask-buttons", off, ...(go ? [on] : []));
  const form = /** @type {HTMLFormElement} */ (
    made("form", "", "", made("h2", title), body, buttons));
  form.method = "dialog";
  const dialog = /** @type {HTMLDialogElement} */ (made("dialog", "", "ask", form));
  dialog.setAttribute("aria-label", title);
  document.body.append(dialog);
  /** @param {() => boolean | void} draw @returns {Promise<string>} */
  const show = async (draw) => {
    const look = () => {
      let may = false; // also where drawing fails
      try {
        may = draw() !== false;
      } finally {
        on.disabled = !may;
      }
    };
    const closed = new Promise((done) => { dialog.addEventListener("close", done); });
    for (const touched of ["click", "input"]) form.addEventListener(touched, look);
    look();
    dialog.showModal();
    const timer = setInterval(look, LOOK_MS);
    await closed;
    clearInterval(timer);
    dialog.remove();
    return dialog.returnValue;
  };
  return { dialog, form, body, on, show };
}
