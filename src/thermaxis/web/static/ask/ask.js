// @ts-check
// How a page asks something of the loop: said in words before, confirmed by a person, then
// requested, accepted or refused with the reason, and effective when the loop's status shows it.
// A question without an answer is neither: it may still take effect, and is watched like the others.

import { keep, kept } from "./kept.js";
import { modelOf } from "./effects.js";
import { LATE_MS, watch } from "./watch.js";
import { button, made, style } from "../elements.js";
import { post } from "../page.js";
import { latest, onNoData, onStatus } from "../live.js";
import { clock, duration, word } from "../words.js";

const LONGEST_MS = 60 * 1000;
const MOST_REQUESTS = 3;

/** @typedef {Record<string, any>} Status */
/** @typedef {"accepted" | "refused" | "unknown"} Kind */
/** @typedef {{kind: Kind, reason: string}} Answer */

/**
 * A request and how far it came; times in milliseconds, all of it kept from page to page.
 * @typedef {object} RequestState
 * @property {string} method
 * @property {(string | number)[]} args
 * @property {string | null} sha256 hash of a model's file
 * @property {string} title what is asked, in words
 * @property {number} requested
 * @property {"waits" | Kind} answer
 * @property {number | null} answered
 * @property {string} reason in words; may be empty
 * @property {string} started when the loop was started that was asked; empty if that is not known
 * @property {number} number the loop's number when it was asked
 * @property {string} model file and hash of the model in force when it was asked
 * @property {string} person name under which it was asked
 * @property {string} ended why it is watched no more, one of ENDS; empty while it is
 * @property {string} stage how far it came before it is effective, in words; may be empty
 * @property {number | null} came when it was effective
 * @property {boolean} blind whether there are no data now
 */

/**
 * @typedef {object} Wording
 * @property {string} title what is asked, also the text of the button that asks it
 * @property {string | string[] | ((status: Status) => string[])} text what will happen; as a
 *   function it is said anew with every status
 * @property {string | null} [sha256] hash of the model's file that is asked for
 * @property {(status: Status) => string} [blocked] why a status leaves nothing to ask for, such as
 *   after somebody else has asked for it; empty where it can be asked
 * @property {string[]} [blind] what is said in place of the text while there are no data; without
 *   it nothing can be asked then
 */

/** @type {RequestState[]} the newest first */
let requests = kept();
let loud = false; // what another page has asked was read aloud there
const saidAloud = made("p", "", "unseen");
saidAloud.setAttribute("aria-live", "polite");

style("ask/ask.css");
document.body.append(saidAloud);
tell();
onStatus(look);
onNoData(() => {
  for (const request of requests) request.blind = true;
  tell();
});

/**
 * Ask, after a person has confirmed what will happen.
 * @param {string} method
 * @param {(string | number)[]} args
 * @param {Wording} wording
 * @returns {Promise<{accepted: boolean, reason: string} | null>} null: not asked
 */
export async function ask(method, args, wording) {
  if (!(await confirmed(wording))) return null;
  const request = begin(method, args, wording);
  const late = { kind: /** @type {Kind} */ ("unknown"), reason: "" };
  const answers = answerOf(method, args);
  const answer = await Promise.race([
    answers,
    new Promise((go) => { setTimeout(() => go(late), LONGEST_MS); }),
  ]);
  take(request, answer);
  if (answer === late) void answers.then((found) => take(request, found));
  return { accepted: answer.kind === "accepted", reason: answer.reason };
}

/** @param {string} method @param {(string | number)[]} args @param {Wording} wording
 * @returns {RequestState} */
function begin(method, args, wording) {
  /** @type {RequestState} */
  const request = {
    method,
    args,
    sha256: wording.sha256 ?? null,
    title: wording.title,
    requested: Date.now(),
    answer: "waits",
    answered: null,
    reason: "",
    started: latest()?.started ?? "",
    number: latest()?.number ?? -1,
    model: modelOf(latest()),
    person: document.body.dataset.name ?? "",
    ended: "",
    stage: "",
    came: null,
    blind: latest() === null,
  };
  requests = [request, ...requests].slice(0, MOST_REQUESTS);
  loud = true;
  tell();
  return request;
}

/** @param {RequestState} request @param {Answer} answer */
function take(request, answer) {
  request.answered = Date.now();
  request.answer = answer.kind;
  request.reason = answer.reason;
  tell();
  const now = latest();
  if (now) look(now);
}

/**
 * @param {string} method
 * @param {(string | number)[]} args
 * @returns {Promise<Answer>} unknown where none came: the question may have reached the loop
 */
async function answerOf(method, args) {
  let answer;
  try {
    answer = await post("/ask", { method, arguments: args });
  } catch (error) {
    if (!(error instanceof TypeError)) throw error;
    return { kind: "unknown", reason: word("operator-ask_unreached") };
  }
  const said = await answer.json().catch(() => null);
  if (answer.status >= 500 || said === null) return { kind: "unknown", reason: "" };
  if (!answer.ok) return { kind: "refused", reason: String(said.text ?? "") };
  return { kind: kindOf(said.answer), reason: String(said.reason) };
}

/** @param {unknown} answer @returns {Kind} */
function kindOf(answer) {
  return answer === "accepted" || answer === "refused" ? answer : "unknown";
}

/** @param {Status} status */
function look(status) {
  watch(requests, status, Date.now());
  tell();
}

// ---- the line that shows how far it came -----------------------------------------------------

function tell() {
  keep(requests);
  const [newest, ...older] = requests;
  if (!newest) return;
  const place = document.querySelector("[data-requests]") ?? ownPlace();
  const lines = [made("b", newest.title), ...linesOf(newest), ...older.map(shortOf)];
  const text = lines.map((line) => line.textContent).join("\n");
  if (place.getAttribute("data-told") === text) return;
  place.setAttribute("data-told", text);
  place.setAttribute("data-answer", newest.answer);
  place.replaceChildren(...lines);
  const aloud = lines.slice(0, lines.length - older.length).map((line) => line.textContent);
  if (loud && saidAloud.textContent !== aloud.join(" ")) saidAloud.textContent = aloud.join(" ");
}

/** @param {RequestState} request */
function linesOf(request) {
  const requested = word("operator-requested_at", { time: clock(request.requested) });
  const lines = [made("span", requested, "ask-began")];
  const time = clock(request.answered);
  if (request.answer === "waits") lines.push(made("span", "→ " + word("operator-answer_waits")));
  if (request.answer === "refused") {
    lines.push(made("span", `→ ✕ ${word("operator-refused_at", { time })}`, "ask-wrong"));
    if (request.reason) lines.push(made("span", request.reason, "ask-why"));
  }
  if (request.answer === "unknown") {
    lines.push(made("span", `→ ? ${word("operator-answer_none")}`, "ask-wrong"));
    lines.push(made("span", "→ " + effectOf(request), "ask-stands"));
    if (request.reason) lines.push(made("span", request.reason, "ask-why"));
  }
  if (request.answer === "accepted") {
    lines.push(made("span", "→ " + word("operator-accepted_at", { time }), "ask-taken"));
    lines.push(made("span", "→ " + effectOf(request), "ask-stands"));
    if (request.reason) lines.push(made("span", request.reason, "ask-reason"));
  }
  return lines;
}

/** A request before the newest one: how it stands, and what was asked when.
 * @param {RequestState} request */
function shortOf(request) {
  const time = clock(request.answered);
  const stands = {
    waits: () => word("operator-answer_waits"),
    refused: () => `✕ ${word("operator-refused_at", { time })}. ${request.reason}`,
    unknown: () => request.came ? effectOf(request)
      : `? ${word("operator-answer_none")}, ${effectOf(request)}`,
    accepted: () => effectOf(request),
  };
  const asked = `${clock(request.requested)} ${request.title}`;
  return made("span", `${stands[request.answer]().trim()} – ${asked}`, "ask-older");
}

/** @type {Record<string, () => string>} */
const ENDED = {
  replaced: () => word("operator-effect_replaced"),
  restarted: () => word("operator-effect_restarted"),
  late: () => word("operator-effective_late", { time: duration(LATE_MS / 1000) }),
  unseen: () => word("operator-effective_unknown"),
};

/** @param {RequestState} request */
function effectOf(request) {
  if (request.came) {
    const time = clock(request.came);
    return request.answer === "unknown" ? word("operator-as_asked_at", { time })
      : `✓ ${word("operator-effective_at", { time })}`;
  }
  if (request.ended) return ENDED[request.ended]?.() ?? "";
  if (request.blind) return word("operator-effective_unknown");
  return request.stage || word("operator-effective_waits");
}

function ownPlace() {
  const place = made("div", "", "ask-place");
  place.setAttribute("data-requests", "");
  document.body.querySelector("main")?.after(place);
  return place;
}

// ---- the confirmation ------------------------------------------------------------------------

/**
 * @param {Wording} wording
 * @returns {Promise<boolean>}
 */
function confirmed(wording) {
  const { dialog, body, buttons } = openDialog(wording.title);
  const confirm = button(wording.title, () => dialog.close("asked"));
  confirm.className = "main";
  buttons.append(confirm);
  const why = made("p", word("operator-why_no_data"), "ask-wrong");
  /** @param {Status | null} status */
  const show = (status) => {
    let may = false; // also where this fails
    try {
      may = said(status);
    } finally {
      confirm.disabled = !may;
    }
  };
  /** Say what will happen, or why nothing can be asked. @param {Status | null} status
   * @returns {boolean} whether it can be asked */
  const said = (status) => {
    if (status === null && !wording.blind) {
      why.textContent = word("operator-why_no_data");
      why.hidden = false;
      delete body.dataset.told;
      return false;
    }
    const blocked = status === null ? "" : wording.blocked?.(status) ?? "";
    const lines = blocked ? [] : textOf(wording, status);
    const told = [blocked, ...lines].join("\n");
    if (body.dataset.told !== told) {
      body.dataset.told = told;
      why.hidden = blocked === "";
      if (blocked) why.textContent = word("operator-nothing_to_ask", { why: blocked });
      body.replaceChildren(...lines.map((line) => made("p", line)), why);
    }
    return blocked === "";
  };
  body.append(why);
  show(latest());
  const timer = setInterval(() => show(latest()), 250);
  dialog.showModal();
  buttons.querySelector("button")?.focus();
  return new Promise((answer) => {
    dialog.addEventListener("close", () => {
      clearInterval(timer);
      dialog.remove();
      answer(dialog.returnValue === "asked");
    });
  });
}

/** @param {Wording} wording @param {Status | null} status null: no data
 * @returns {string[]} */
function textOf(wording, status) {
  const said = status === null ? wording.blind ?? [] : wording.text;
  const text = typeof said === "function" ? said(/** @type {Status} */ (status)) : said;
  const lines = Array.isArray(text) ? text : [text];
  const name = document.body.dataset.name;
  return name ? [...lines, word("operator-asks_under", { name })] : lines;
}

/**
 * A dialog with a title, a body and a button that leaves it; not yet shown.
 * @param {string} title
 * @param {string} [leave] text of the button that leaves it
 */
export function openDialog(title, leave = word("common-cancel")) {
  const dialog = /** @type {HTMLDialogElement} */ (made("dialog", "", "ask"));
  const heading = made("h2", title);
  heading.id = `ask-${document.querySelectorAll("dialog").length}`;
  dialog.setAttribute("aria-labelledby", heading.id);
  const body = made("div", "", "ask-body");
  const buttons = made("div", "", "ask-buttons", button(leave, () => dialog.close("")));
  dialog.append(heading, body, buttons);
  document.body.append(dialog);
  return { dialog, body, buttons };
}
