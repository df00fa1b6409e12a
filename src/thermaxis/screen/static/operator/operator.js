// @ts-check
// The operator's page: state, alarms, corrections, inputs, trend, connections, interventions.

import { openDialog } from "../ask/ask.js";
import { byId, hasEnglish, made, overflows, say } from "../elements.js";
import { alarmMark } from "../frame.js";
import { lastKnown, latest, onNoData, onStatus } from "../live.js";
import { showAsks, startAsks } from "./asks.js";
import { fillDetails, onCard, showAxes } from "./axes.js";
import { fillInputs, showInputs } from "./inputs.js";
import { addLive, startTrend } from "./trend.js";
import { clock, duration, number, timeOf, word } from "../words.js";

/** @typedef {Record<string, any>} Status */

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
  say(byId("state-word"), status.state_said);
  say(byId("state-since"), word("operator-since", { time: timeOf(status.state_since) }));
  say(byId("state-reasons"), status.reasons_said.join(" ")
    || (status.state === "Active" ? word("operator-everything_there") : ""));
  tick();
}

function tick() {
  if (!latest()) return;
  const passed = Math.max(0, (performance.now() - stateBeganMs) / 1000);
  say(byId("state-for"), Number.isFinite(passed)
    ? word("operator-for", { time: duration(passed) }) : "");
}

// ---- alarms ----------------------------------------------------------------------------------

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
  say(byId("alarm-count"), "?");
  say(byId("alarm-word"), "");
  say(byId("alarm-text"), word("operator-alarms_unknown"));
  say(byId("alarm-more"), !status ? "" : !first ? word("operator-alarms_before_none")
    : word("operator-alarms_before", {
      count: status.alarms.length, priority: first.priority_said,
      text: first.text,
    }));
}

/** @param {Status} status */
function showAlarm(status) {
  const [first] = status.alarms;
  const priority = first?.priority ?? "none";
  say(byId("alarm-count"), String(status.alarms.length));
  markAlarm(priority);
  say(byId("alarm-word"), first ? `${first.priority_said}:` : "");
  say(byId("alarm-text"), first ? first.text : word("operator-no_alarm"));
  const more = byId("alarm-more");
  if (!first) {
    say(more, word("operator-no_alarm_more"));
    return;
  }
  const since = word("operator-since", { time: timeOf(first.since) });
  const said = [since, first.cause, first.remedy];
  say(more, said.filter(Boolean).join(" · "));
}

/** @param {HTMLElement} body @param {Status} status */
function fillAlarms(body, status) {
  const old = latest() === null;
  const drawn = JSON.stringify([old, status.alarms]);
  if (body.dataset.told === drawn) return;
  body.dataset.told = drawn;
  const head = old
    ? [made("p", word("operator-alarms_old", { time: timeOf(status.utc) }), "ask-wrong")] : [];
  if (!status.alarms.length) {
    const none = old ? word("operator-alarms_before_none") : word("operator-no_alarm");
    body.replaceChildren(...head, made("p", none));
    return;
  }
  const foreign = status.alarms.some((/** @type {Record<string, any>} */ one) =>
    [one.text, one.cause, one.remedy, one.detail ?? ""].some(hasEnglish));
  const foot = foreign ? [made("p", word("common-details_english"), "op-quiet")] : [];
  body.replaceChildren(...head, ...status.alarms.map((/** @type {Record<string, any>} */ alarm) => {
    const item = made("section", "", "op-alarm-item");
    const text = made("div", "");
    const head = made("p");
    head.append(
      made("b", `${alarm.priority_said}: `), made("span", `${alarm.text} `),
      made("span", word("operator-came", { time: timeOf(alarm.since) }), "op-quiet"),
    );
    text.append(head, pair(word("operator-cause"), alarm.cause),
      pair(word("operator-remedy"), alarm.remedy));
    if (alarm.detail) text.append(pair(word("operator-detail"), alarm.detail));
    item.append(alarmMark(alarm.priority), text);
    return item;
  }), ...foot);
}

/** @param {string} label @param {string} text */
function pair(label, text) {
  const line = made("p");
  line.append(made("span", `${label}: `, "op-quiet"), made("span", text || "–"));
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
  say(byId("beat-text"), word("operator-beat", beat));
  link("link-source", status.source_connected, word("operator-source_good"),
    word("operator-source_lost"));
  link("link-sink", status.sink_connected, word("operator-sink_good"), word("operator-sink_lost"));
  link("link-history", status.historian.storing, word("operator-history_good"),
    word("operator-history_bad"));
  const [good, text] = modelSaid(status);
  link("model-told", good, text, text);
}

/** @param {Status} status @returns {[boolean, string]} */
function modelSaid(status) {
  const file = status.model_file.replace(/\.json$/, "");
  const weight = Math.min(1, ...Object.values(status.outputs).map((axis) => axis.weight ?? 1));
  if (status.quality === "bad") return [false, word("operator-model_bad", { file })];
  if (status.quality === "held") return [false, word("operator-model_held", { file })];
  if (weight >= 1) return [true, word("operator-model_good", { file })];
  return [false, word("operator-model_outside", { file, weight: number(100 * weight, 0) })];
}

/** @param {string} id @param {boolean} good @param {string} well @param {string} ill */
function link(id, good, well, ill) {
  byId(id).dataset.good = good ? "yes" : "no";
  say(byId(id), good ? well : `▲ ${ill}`);
}

// ---- dialogs ---------------------------------------------------------------------------------

/**
 * A dialog that is filled with every status while it is open.
 * @param {string} title
 * @param {(body: HTMLElement, status: Status) => void} fill
 */
function openList(title, fill) {
  if (document.querySelector("dialog[open]")) return;
  const { dialog, body } = openDialog(title, word("common-close"));
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
  openList(word("operator-alarm_list"), fillAlarms);
}

function openAxes() {
  openList(word("operator-all_corrections"), fillDetails);
}

function openInputs() {
  openList(word("operator-all_inputs"), (body, status) => {
    const list = body.querySelector("ul")
      ?? body.appendChild(made("ul", "", "op-rows op-rows-all"));
    fillInputs(/** @type {HTMLElement} */ (list), status, Object.keys(status.inputs));
  });
}

/** How far the last request came, where that is longer than its place. */
function watchRequest() {
  const place = byId("request");
  const open = () => {
    if (!place.childElementCount) return;
    openList(word("operator-request"), (body) => {
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
  say(byId("state-word"), word("common-no_data"));
  say(byId("state-since"), none.since === null ? ""
    : word("operator-since", { time: timeOf(none.since) }));
  const before = lastKnown();
  say(byId("state-for"), before
    ? word("operator-before", { state: before.state_said }) : "");
  say(byId("state-reasons"), none.text);
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
