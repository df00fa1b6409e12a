// @ts-check
// The connection to the screen's server: what the loop tells, and how old it is by the page's own
// clock. It is made again for ever; another run of the server makes the page load itself again.

import { clock, moment, word } from "./words.js";

const SHORTEST_S = 3;
const CYCLES = 3;
const FIRST_RETRY_MS = 500;
const LONGEST_RETRY_MS = 2000;
const TOO_MANY_PAGES = 1013;
const SILENT_MS = 5000;
const LOOK_MS = 250;
const JUMP_MS = 2000;
const CLOCKS_APART = 2e-4; // by so much two computers' clocks may run apart; crystals: 1e-4

/** @typedef {Record<string, any>} Status */
/** @typedef {{text: string, since: string | null}} NoData */

/** @type {((status: Status, ageS: number) => void)[]} */
const statusListeners = [];
/** @type {(() => void)[]} */
const liveListeners = [];
/** @type {((none: NoData) => void)[]} */
const noDataListeners = [];

/** @type {Status | null} */
let last = null;
let lastMs = Number.NEGATIVE_INFINITY;
let openedMs = performance.now();
let heardMs = performance.now();
let retryMs = FIRST_RETRY_MS;
/** Why there are no data, as far as that is known: else there is no connection. */
let why = "";
/** When the last status was true, also of one that this page never saw. @type {string | null} */
let since = null;
let live = false;
let complained = false;
/** Smallest time on the way that this connection has seen, and when [s]. */
let shortest = { lagS: Infinity, atS: 0 };
let apartMs = Date.now() - performance.now();
/** @type {WebSocket | null} */
let socket = null;

/** @param {(status: Status, ageS: number) => void} listener */
export function onStatus(listener) {
  statusListeners.push(listener);
  const now = last;
  if (live && now && !went(() => listener(now, ageS()))) tellUnreadable();
}

/** Told after a status that every part of the page could show. @param {() => void} listener */
export function onLive(listener) {
  liveListeners.push(listener);
}

/** @param {(none: NoData) => void} listener */
export function onNoData(listener) {
  noDataListeners.push(listener);
}

/** The last status while it is fresh, else null. */
export function latest() {
  return live ? last : null;
}

/** The last status that ever came, for what is marked as old. */
export function lastKnown() {
  return last;
}

function ageS() {
  return (performance.now() - lastMs) / 1000;
}

function longestAgeS() {
  return Math.max(SHORTEST_S, CYCLES * (last?.cycle_s ?? 1));
}

/** Begin. */
export function startLive() {
  window.addEventListener("pageshow", (event) => { if (event.persisted) location.reload(); });
  connect();
  setInterval(look, LOOK_MS);
}

function connect() {
  const scheme = location.protocol === "https:" ? "wss:" : "ws:";
  openedMs = performance.now();
  heardMs = openedMs;
  shortest = { lagS: Infinity, atS: 0 };
  const mine = new WebSocket(`${scheme}//${location.host}/live`);
  socket = mine;
  mine.addEventListener("message", (event) => hear(String(event.data)));
  mine.addEventListener("close", (event) => {
    if (socket !== mine) return;
    socket = null;
    if (event.code === TOO_MANY_PAGES) retryMs = LONGEST_RETRY_MS;
    else why = "";
    setTimeout(connect, retryMs);
    retryMs = Math.min(LONGEST_RETRY_MS, 1.5 * retryMs);
  });
}

/** @param {string} text */
function hear(text) {
  heardMs = performance.now();
  retryMs = FIRST_RETRY_MS;
  const message = read(text);
  const { kind } = message;
  const oldS = message.status ? message.age_s + transitS(message.sent_s) : NaN;
  if (kind === "status" && Number.isFinite(oldS)) {
    take(message.status, oldS);
  } else if (kind === "no_data") {
    why = message.text;
    since = message.since ?? since;
    if (!last && Number.isFinite(oldS)) recall(message.status, oldS);
    tellNone();
  } else if (kind === "hello") {
    if (isOld(message)) location.reload();
  } else if (kind === "ended") {
    leaveNotice(message.text);
    location.reload();
  } else tellUnreadable(); // also a status whose age is not known
}

/** @param {string} text @returns {Record<string, any>} */
function read(text) {
  try {
    return JSON.parse(text);
  } catch {
    return {};
  }
}

/**
 * Time that a message took on its way, beyond the shortest that this connection has seen: what
 * waits in the network, or in a page that was busy, is as old as it is.
 * @param {number} sentS the server's own clock
 */
function transitS(sentS) {
  const nowS = performance.now() / 1000;
  const lagS = nowS - sentS;
  const drifted = shortest.lagS + CLOCKS_APART * (nowS - shortest.atS);
  shortest = { lagS: Math.min(lagS, drifted), atS: nowS };
  return lagS - shortest.lagS;
}

/** @param {Status} status @param {number} oldS how old it is by now */
function take(status, oldS) {
  if (jumped()) return;
  const before = { last, lastMs, since };
  why = "";
  last = status;
  lastMs = performance.now() - 1000 * oldS;
  since = status.utc;
  if (oldS > longestAgeS()) {
    look();
    return;
  }
  live = true;
  const shown = statusListeners.map((listener) => went(() => listener(status, oldS)));
  if (shown.every(Boolean)) {
    for (const listener of liveListeners) went(listener);
    return;
  }
  ({ last, lastMs, since } = before);
  tellUnreadable();
}

/** Show the last status that the server has, which is called old at once.
 * @param {Status} status @param {number} oldS */
function recall(status, oldS) {
  last = status;
  lastMs = performance.now() - 1000 * oldS;
  for (const listener of statusListeners) went(() => listener(status, oldS));
}

/** Whether a part of the page could do something; why not is told once. @param {() => void} act */
function went(act) {
  try {
    act();
    return true;
  } catch (error) {
    if (!complained) console.error(error);
    complained = true;
    return false;
  }
}

function tellUnreadable() {
  why = word("operator-page_cannot_read");
  tellNone();
}

/**
 * Whether the clocks of this computer have parted since the last look: it was asleep, or was set.
 * What then arrives may have waited: only a new connection tells what is so now.
 */
function jumped() {
  const now = Date.now() - performance.now();
  const far = Math.abs(now - apartMs) > JUMP_MS;
  apartMs = now;
  if (!far) return false;
  lastMs = Number.NEGATIVE_INFINITY;
  again();
  tellNone();
  return true;
}

/** Leave the connection for a new one. */
function again() {
  const dead = socket;
  socket = null;
  why = "";
  dead?.close();
  if (dead) connect();
}

/**
 * Whether this page was made by another run of the server, or for somebody who is no more.
 * @param {{program: string, name: string, role: string}} hello
 */
function isOld(hello) {
  const { program, name, role } = document.body.dataset;
  if (hello.program !== program) {
    if (name && !hello.name) leaveNotice(word("login-started_anew"));
    return true;
  }
  return hello.name !== name || hello.role !== role;
}

/** @param {string} text */
function leaveNotice(text) {
  try {
    sessionStorage.setItem("notice", text);
  } catch {
    // the page that follows shows by itself that nobody is logged in
  }
}

/** Judge by the page's own clock: neither the server nor the loop need be there for it. */
function look() {
  if (jumped()) return;
  if (performance.now() - heardMs > SILENT_MS) again();
  const waited = last ? ageS() : (performance.now() - openedMs) / 1000;
  if (waited > longestAgeS()) tellNone();
}

function tellNone() {
  live = false;
  const text = why || word("common-no_connection_to_screen");
  for (const listener of noDataListeners) went(() => listener({ text, since }));
}

/**
 * The words of a page without fresh values.
 * @param {NoData} none
 */
export function noDataWords(none) {
  if (none.since === null) return `${word("common-no_data")}. ${none.text}`;
  const day = new Date(none.since).toDateString() === new Date().toDateString();
  const time = day ? clock(none.since) : moment(none.since);
  return `${word("common-no_data_since", { time })}. ${none.text}`;
}
