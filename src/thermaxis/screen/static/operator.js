// @ts-check
// The operator's page: state, alarms, corrections, inputs, trend, connections, interventions.

import { made, openDialog } from "./ask.js";
import { englishNote, englishOf, sayWithEnglish, withEnglish } from "./english.js";
import { alarmMark } from "./frame.js";
import { lastKnown, latest, onNoData, onStatus } from "./live.js";
import { showAsks, startAsks } from "./operator_asks.js";
import { fillDetails, onCard, showAxes } from "./operator_axes.js";
import { fillInputs, showInputs } from "./operator_inputs.js";
import {
  byId, overflows, priorityWord, reasonsSaid, show, stateWord,
} from "./operator_parts.js";
import { addLive, startTrend } from "./operator_trend.js";
import { alarmWords, clock, duration, moment, number, word } from "./words.js";

/** @typedef {Record<string, any>} Status */

const HISTORY_FAILS = "historian_unstated";
/** Of the list of requests, where it has no room: what is left out first. */
const LEFT_OUT = ["ask-began", "ask-reason", "ask-taken", "ask-older", "ask-why"];

/** By this page's own clock, so that the loop's and the panel's may differ. */
let stateBeganMs = NaN;
let beatNumber = -1;
/** @type {(() => void) | null} */
let redraw = null;

/** @param {Status} status */
function showState(status) {
  const box = byId("op");
  box.dataset.state = status.state;
  show(byId("state-word"), stateWord(status.state));
  show(byId("state-since"), word("operator.since", { time: timeOf(status.state_since) }));
  const reasons = reasonsSaid(status);
  show(byId("state-reasons"), reasons.join(" ")
    || (status.state === "Active" ? word("operator.everything_there") : ""));
  tick();
}

/** The time of day; with the date if it was another day. @param {string} time */
function timeOf(time) {
  const today = new Date(time).toDateString() === new Date().toDateString();
  return today ? clock(time) : moment(time);
}

function tick() {
  if (!latest()) return;
  const passed = Math.max(0, (performance.now() - stateBeganMs) / 1000);
  show(byId("state-for"), Number.isFinite(passed)
    ? word("operator.for", { time: duration(passed) }) : "");
}

// ---- alarms ----------------------------------------------------------------------------------

/** One sentence of an alarm: why the history fails is for who looks at the details.
 * @param {Record<string, any>} alarm @param {"text" | "cause" | "remedy"} what */
function told(alarm, what) {
  const shown = alarm.code === "historian" ? { ...alarm, code: HISTORY_FAILS } : alarm;
  return alarmWords(/** @type {any} */ (shown))[what];
}

/** @param {string} priority */
function markAlarm(priority) {
  const banner = byId("alarm");
  if (banner.dataset.priority === priority) return;
  banner.dataset.priority = priority;
  const known = priority !== "none" && priority !== "unknown";
  byId("alarm-mark").replaceChildren(...(known ? [alarmMark(priority)] : []));
}

/** Without data nobody knows of alarms; what stood before is said as such.
 * @param {Status | null} status */
function showOldAlarm(status) {
  const first = status?.alarms[0];
  markAlarm("unknown");
  show(byId("alarm-count"), "?");
  show(byId("alarm-word"), "");
  show(byId("alarm-text"), word("operator.alarms_unknown"));
  show(byId("alarm-more"), !status ? "" : !first ? word("operator.alarms_before_none")
    : word("operator.alarms_before", {
      count: status.alarms.length, priority: priorityWord(first.priority),
      text: told(first, "text"),
    }));
}

/** @param {Status} status */
function showAlarm(status) {
  const [first] = status.alarms;
  const priority = first?.priority ?? "none";
  show(byId("alarm-count"), String(status.alarms.length));
  markAlarm(priority);
  show(byId("alarm-word"), first ? `${priorityWord(priority)}:` : "");
  const english = first ? englishOf(first) : [];
  sayWithEnglish(byId("alarm-text"), first ? told(first, "text") : word("operator.no_alarm"),
    english);
  const more = byId("alarm-more");
  if (!first) {
    show(more, word("operator.no_alarm_more"));
    return;
  }
  const since = word("operator.since", { time: timeOf(first.since) });
  const said = [since, told(first, "cause"), told(first, "remedy")];
  sayWithEnglish(more, said.filter(Boolean).join(" · "), english);
}

/** @param {HTMLElement} body @param {Status} status */
function fillAlarms(body, status) {
  const old = latest() === null;
  const drawn = JSON.stringify([old, status.alarms]);
  if (body.dataset.told === drawn) return;
  body.dataset.told = drawn;
  const head = old
    ? [made("p", word("operator.alarms_old", { time: timeOf(status.utc) }), "ask-wrong")] : [];
  if (!status.alarms.length) {
    const none = old ? word("operator.alarms_before_none") : word("operator.no_alarm");
    body.replaceChildren(...head, made("p", none));
    return;
  }
  const note = status.alarms.some((/** @type {Record<string, any>} */ one) =>
    englishOf(one).length || one.code === "historian") ? englishNote() : "";
  const foot = note ? [made("p", note, "op-quiet")] : [];
  body.replaceChildren(...head, ...status.alarms.map((/** @type {Record<string, any>} */ alarm) => {
    const english = englishOf(alarm);
    const item = made("section", "", "op-alarm-item");
    const text = made("div", "");
    const head = made("p", "");
    head.append(
      made("b", `${priorityWord(alarm.priority)}: `),
      ...withEnglish(`${told(alarm, "text")} `, english),
      made("span", word("operator.came", { time: timeOf(alarm.since) }), "op-quiet"),
    );
    text.append(head, pair(word("operator.cause"), told(alarm, "cause"), english),
      pair(word("operator.remedy"), told(alarm, "remedy"), english));
    if (alarm.code === "historian") {
      const failure = String(alarm.values?.failure ?? alarm.text);
      text.append(pair(word("operator.detail"), failure, [failure]));
    }
    item.append(alarmMark(alarm.priority), text);
    return item;
  }), ...foot);
}

/** @param {string} label @param {string} text @param {string[]} english what of it is English */
function pair(label, text, english) {
  const line = made("p", "");
  line.append(made("span", `${label}: `, "op-quiet"), ...withEnglish(text || "–", english));
  return line;
}

// ---- connections, heartbeat, model -----------------------------------------------------------

/** @param {Status} status */
function showStrip(status) {
  if (status.number !== beatNumber) {
    beatNumber = status.number;
    byId("beat").dataset.beat = status.number % 2 ? "odd" : "even";
  }
  const beat = { number: status.number, time: clock(status.utc) };
  show(byId("beat-text"), word("operator.beat", beat));
  link("link-source", status.source_connected, word("operator.source_good"),
    word("operator.source_lost"));
  link("link-sink", status.sink_connected, word("operator.sink_good"), word("operator.sink_lost"));
  link("link-history", status.historian.storing, word("operator.history_good"),
    word("operator.history_bad"));
  const [good, text] = modelSaid(status);
  link("model-told", good, text, text);
}

/** @param {Status} status @returns {[boolean, string]} */
function modelSaid(status) {
  const file = status.model_file.replace(/\.json$/, "");
  const weight = Math.min(1, ...Object.values(status.outputs).map((axis) => axis.weight ?? 1));
  if (status.quality === "bad") return [false, word("operator.model_bad", { file })];
  if (status.quality === "held") return [false, word("operator.model_held", { file })];
  if (weight >= 1) return [true, word("operator.model_good", { file })];
  return [false, word("operator.model_outside", { file, weight: number(100 * weight, 0) })];
}

/** @param {string} id @param {boolean} good @param {string} well @param {string} ill */
function link(id, good, well, ill) {
  byId(id).dataset.good = good ? "yes" : "no";
  show(byId(id), good ? well : `▲ ${ill}`);
}

// ---- dialogs ---------------------------------------------------------------------------------

/**
 * A dialog that is filled with every status while it is open.
 * @param {string} title
 * @param {(body: HTMLElement, status: Status) => void} fill
 */
function openList(title, fill) {
  if (document.querySelector("dialog[open]")) return;
  const { dialog, body } = openDialog(title, word("common.close"));
  dialog.classList.add("op-wide");
  redraw = () => {
    const status = lastKnown();
    if (status) fill(body, status);
  };
  redraw();
  dialog.addEventListener("close", () => {
    redraw = null;
    dialog.remove();
  });
  dialog.showModal();
}

function openAlarms() {
  openList(word("operator.alarm_list"), fillAlarms);
}

function openAxes() {
  openList(word("operator.all_corrections"), fillDetails);
}

function openInputs() {
  openList(word("operator.all_inputs"), (body, status) => {
    const list = body.querySelector("ul")
      ?? body.appendChild(made("ul", "", "op-rows op-rows-all"));
    fillInputs(/** @type {HTMLElement} */ (list), status, Object.keys(status.inputs));
  });
}

/** The course of the last request, where it is longer than its place. */
function watchRequest() {
  const place = byId("request");
  const open = () => {
    if (!place.childElementCount) return;
    openList(word("operator.request"), (body) => {
      if (body.textContent === place.textContent) return;
      body.replaceChildren(...[...place.children].map((line) => {
        const copy = made("p", "");
        copy.append(.../** @type {Element} */ (line.cloneNode(true)).childNodes);
        return copy;
      }));
    });
  };
  const look = () => {
    const lines = /** @type {HTMLElement[]} */ ([...place.children]);
    for (const line of lines) line.hidden = false;
    place.dataset.more = "no"; // it is judged as it is whole
    if (!overflows(place)) return;
    place.dataset.more = "yes";
    for (const name of LEFT_OUT) {
      for (const line of lines.filter((one) => one.classList.contains(name)).reverse()) {
        if (!overflows(place)) return;
        line.hidden = true;
      }
    }
  };
  place.addEventListener("click", open);
  new MutationObserver(look).observe(place, { childList: true });
  new ResizeObserver(look).observe(place);
}

/** The link to the alarms in the header of every page leads here. */
function followHash() {
  if (location.hash !== "#alarms") return;
  history.replaceState(null, "", location.pathname);
  openAlarms();
}

// ---- begin -----------------------------------------------------------------------------------

/** @param {Status} status */
function showAll(status) {
  showState(status);
  showAlarm(status);
  showStrip(status);
  showAsks(latest());
  showAxes(status); // these two fill the room that the others leave
  showInputs(status);
  redraw?.();
}

onStatus((status, ageS) => {
  stateBeganMs = performance.now() - 1000 * (ageS + (status.in_state_s ?? NaN));
  byId("alarm-body").setAttribute("aria-live", "assertive");
  showAll(status);
  addLive(status);
});
onNoData((none) => {
  byId("alarm-body").setAttribute("aria-live", "off"); // the frame says NO DATA aloud
  const word_ = byId("state-word");
  show(word_, word("common.no_data"));
  show(byId("state-since"), none.since === null ? ""
    : word("operator.since", { time: timeOf(none.since) }));
  const before = lastKnown();
  show(byId("state-for"), before
    ? word("operator.before", { state: stateWord(before.state) }) : "");
  show(byId("state-reasons"), none.text);
  showOldAlarm(before);
  if (before) showInputs(before);
  showAsks(null);
  redraw?.();
});
for (const id of ["differs", "notice"]) {
  const bar = document.getElementById(id);
  if (bar) byId("trend").after(bar);
}
byId("alarm").addEventListener("click", openAlarms);
byId("inputs-open").addEventListener("click", openInputs);
onCard(openAxes);
window.addEventListener("hashchange", followHash);
new ResizeObserver(() => {
  const status = lastKnown();
  if (!status) return;
  showAxes(status);
  showInputs(status);
}).observe(byId("op"));
setInterval(tick, 1000);
startAsks();
watchRequest();
showAsks(null);
startTrend();
followHash();
