// @ts-check
// The operator's page: state, what is the matter, alarms, offsets, trend, connections, requests.

import { openDialog } from "../ask/ask.js";
import { byId, hasEnglish, made, say } from "../elements.js";
import { alarmMark } from "../frame.js";
import { lastKnown, latest, onNoData, onStatus } from "../live.js";
import { showAsks, startAsks } from "./asks.js";
import { fillDetails, fit, showAxes, touchesSaid } from "./axes.js";
import { fillInputs, showInputs } from "./inputs.js";
import { facts } from "./parts.js";
import { startTrend } from "./trend.js";
import { clock, duration, number, shortNames, timeOf, word } from "../words.js";

/** @typedef {Record<string, any>} Status */

const HELPS_MS = 300_000;
/** Letters that stand out above capitals, or below them. */
const BEYOND = /[^ -~]|j/i;
const CALM = ["off", "active"];
/** Signs that stand for more than one of what may be the matter. */
const SIGNS = /** @type {Record<string, string>} */ ({
  inputs_unreachable: "input_lost", not_released: "interlock", hold_expired: "held_by_person",
  hold_lost: "fading", on_its_way: "warming", starting: "warming", another_writer: "not_acting",
});

/** When the last status came, and since when what is the matter lasts, by this page's clock: the
 * loop's may differ. */
let toldMs = NaN;
let beganMs = NaN;
let beatNumber = -1;

/** What is the matter, without its beginning `headline-`. @param {Status} status */
function lookOf(status) {
  return status.headline.code.replace(/^headline-/, "");
}

/** Show a sign and a word that differ at first sight. @param {string} look @param {string} said */
function showLook(look, said) {
  byId("op").dataset.look = look;
  byId("state-sign").setAttribute("href", `#sign-${SIGNS[look] ?? look}`);
  const place = byId("state-word");
  const [beyond] = BEYOND.exec(said) ?? [];
  if (beyond) place.dataset.beyond = beyond.toUpperCase();
  else delete place.dataset.beyond;
  say(place, said);
  fit(place);
}

/** @param {Status} status */
function showState(status) {
  const look = lookOf(status);
  byId("op").dataset.state = status.state;
  showLook(look, status.state_said);
  say(byId("headline"), status.headline_said.text);
  say(byId("remedy"), status.headline_said.remedy);
  say(byId("before"), "");
  showSince(status.headline_since, status.headline_since === status.started);
}

/** @param {string | null} since @param {boolean} [longer] whether it may have been so before */
function showSince(since, longer = false) {
  const key = longer ? "operator-since_start" : "operator-since";
  say(byId("state-since"), since === null ? "" : word(key, { time: timeOf(since) }));
}

function tick() {
  const known = lastKnown();
  const passedS = Math.max(0, (performance.now() - beganMs) / 1000);
  const counts = latest() !== null && Number.isFinite(passedS);
  say(byId("state-for"), counts ? word("operator-for", { time: duration(passedS) }) : "");
  if (known) showAxes(known, (performance.now() - toldMs) / 1000, latest() !== null);
}

// ---- alarms ----------------------------------------------------------------------------------

/** @param {string} priority @param {string} count @param {string[]} texts */
function showBanner(priority, count, [first, text, more]) {
  const banner = byId("alarm");
  if (banner.dataset.priority !== priority) {
    banner.dataset.priority = priority;
    const known = !["none", "unknown"].includes(priority);
    byId("alarm-mark").replaceChildren(...(known ? [alarmMark(priority)] : []));
  }
  say(byId("alarm-count"), count);
  say(byId("alarm-word"), first ?? "");
  say(byId("alarm-text"), text ?? "");
  say(byId("alarm-more"), more ?? "");
}

/** Without data nobody knows of alarms; what stood before is said as such.
 * @param {Status | null} status */
function showOldAlarm(status) {
  const first = status?.alarms[0];
  const before = !status ? "" : !first ? word("operator-alarms_before_none")
    : word("operator-alarms_before", {
      count: status.alarms.length, priority: first.priority_said, text: first.text,
    });
  showBanner("unknown", "?", ["", word("operator-alarms_unknown"), before]);
}

/** @param {Status} status */
function showAlarm(status) {
  const [first] = status.alarms;
  if (!first) {
    const calm = CALM.includes(lookOf(status)) && !status.opened_said;
    const more = calm ? word("operator-no_alarm_more") : "";
    showBanner("none", "0", ["", word("operator-no_alarm"), more]);
    return;
  }
  const more = [first.cause, first.remedy].filter(Boolean).join(" · ");
  const count = String(status.alarms.length);
  showBanner(first.priority, count, [`${first.priority_said}:`, first.text, more]);
}

/** @param {HTMLElement} body @param {Status} status */
function fillAlarms(body, status) {
  const old = latest() === null;
  const drawn = JSON.stringify([old, status.alarms]);
  if (body.dataset.told === drawn) return;
  body.dataset.told = drawn;
  /** @type {Record<string, any>[]} */
  const alarms = status.alarms;
  const head = old
    ? [made("p", word("operator-alarms_old", { time: timeOf(status.utc) }), "ask-wrong")] : [];
  const none = old ? word("operator-alarms_before_none") : word("operator-no_alarm");
  const foreign = alarms.some((one) =>
    [one.text, one.cause, one.remedy, one.detail ?? ""].some(hasEnglish));
  const foot = foreign ? [made("p", word("common-details_english"), "op-quiet")] : [];
  const items = alarms.length ? alarms.map((alarm) => made("section", "", "op-alarm-item",
    alarmMark(alarm.priority),
    made("div", "", "",
      made("p", "", "", made("b", `${alarm.priority_said}: `), made("span", `${alarm.text} `),
        made("span", word("operator-came", { time: timeOf(alarm.since) }), "op-quiet")),
      pair(word("operator-cause"), alarm.cause), pair(word("operator-remedy"), alarm.remedy),
      ...(alarm.detail ? [pair(word("operator-detail"), alarm.detail)] : []),
    ))) : [made("p", none)];
  body.replaceChildren(...head, ...items, ...foot);
}

/** @param {string} label @param {string} text */
function pair(label, text) {
  return made("p", "", "", made("span", `${label}: `, "op-quiet"), made("span", text || "–"));
}

// ---- whether it helps, connections, heartbeat, model -----------------------------------------

/** Ask the probes, and tell of the axis that still moves most. */
async function askWhetherItHelps() {
  const answer = await fetch("/helps", { cache: "no-store" }).catch(() => null);
  const found = answer?.ok ? await answer.json().catch(() => ({})) : {};
  const [worst] = Object.entries(found).filter(([, one]) => one.ratio !== null)
    .sort(([, a], [, b]) => b.compensated_um - a.compensated_um);
  showWhetherItHelps(worst ? word("operator-helps_by", {
    axis: shortNames(worst[0]), without: number(worst[1].uncompensated_um, 0),
    with: number(worst[1].compensated_um, 0),
  }) : word("operator-helps_unknown"));
}

/** @param {string} told */
function showWhetherItHelps(told) {
  say(byId("helps"), `${word("operator-helps")} ${told}`);
}

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
  const touches = touchesSaid(status);
  if (touches) link("touched", touches[0], touches[1], touches[1]);
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
  say(byId(id), good ? `${well} ✓` : `▲ ${ill}`);
}

// ---- dialogs ---------------------------------------------------------------------------------

/** @param {string} title @param {(body: HTMLElement, status: Status) => void} fill */
function openList(title, fill) {
  const { dialog, body, show } = openDialog(title, { leave: word("common-close") });
  dialog.classList.add("op-wide");
  void show(() => {
    const status = lastKnown();
    if (status) fill(body, status);
  });
}

function openAlarms() {
  openList(word("operator-alarm_list"), fillAlarms);
}

/** How far the last requests came, which may be longer than its place. */
function openRequests() {
  const place = byId("request");
  if (!place.childElementCount) return;
  openList(word("operator-request"), (body) => {
    if (body.textContent === place.textContent) return;
    body.replaceChildren(...[...place.children].map((line) =>
      made("p", "", "", .../** @type {Element} */ (line.cloneNode(true)).childNodes)));
  });
}

/** The link to the alarms in the header of every page leads here. */
function followHash() {
  if (location.hash !== "#alarms") return;
  history.replaceState(null, "", location.pathname);
  openAlarms();
}

// ---- begin -----------------------------------------------------------------------------------

onStatus((status, ageS) => {
  toldMs = performance.now() - 1000 * ageS;
  const lastedS = (Date.parse(status.utc) - Date.parse(status.headline_since)) / 1000;
  beganMs = toldMs - 1000 * lastedS;
  byId("alarm-body").setAttribute("aria-live", "assertive");
  showState(status);
  tick();
  showAlarm(status);
  showStrip(status);
  showAsks(status);
  showInputs(status);
});
onNoData((none) => {
  byId("alarm-body").setAttribute("aria-live", "off"); // the frame says NO DATA aloud
  const before = lastKnown();
  showLook("no_data", word("operator-look_no_data"));
  showSince(none.since);
  say(byId("headline"), none.text);
  say(byId("remedy"), word("operator-no_data_remedy"));
  say(byId("before"), before ? word("operator-before", { state: before.state_said }) : "");
  showOldAlarm(before);
  if (before) showInputs(before);
  showAsks(null);
  tick();
});
for (const id of ["differs", "notice"]) {
  const bar = document.getElementById(id);
  if (bar) byId("trend").after(bar);
}
byId("alarm").addEventListener("click", openAlarms);
byId("inputs-open").addEventListener("click", () => {
  openList(word("operator-all_inputs"), fillInputs);
});
byId("cards").addEventListener("click", () => {
  openList(word("operator-all_corrections"), fillDetails);
});
byId("request").addEventListener("click", openRequests);
window.addEventListener("hashchange", followHash);
new ResizeObserver(() => {
  for (const one of document.querySelectorAll(".op-fit > *")) fit(/** @type {HTMLElement} */ (one));
}).observe(byId("op"));
setInterval(tick, 1000);
startAsks();
showAsks(null);
say(byId("trend-told"), word("operator-trend_waits"));
void startTrend();
showWhetherItHelps(word("operator-helps_unknown"));
if (facts.probed) {
  void askWhetherItHelps();
  setInterval(() => { void askWhetherItHelps(); }, HELPS_MS);
}
followHash();
