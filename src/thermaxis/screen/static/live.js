// @ts-check
// The connection to the screen's server: what the loop tells, and how old it is by the page's own
// clock. It is made again for ever; another run of the server makes the page load itself again.

import { clock, moment, word } from "./words.js";

const SHORTEST_S = 3;
const CYCLES = 3;
const FIRST_RETRY_MS = 500;
const LONGEST_RETRY_MS = 2000;
const SILENT_MS = 5000;

/** @typedef {Record<string, any>} Status */
/** @typedef {{text: string, since: string | null}} NoData */

/** @type {((status: Status, ageS: number) => void)[]} */
const statusListeners = [];
/** @type {((none: NoData) => void)[]} */
const noDataListeners = [];
/** @type {((visitor: {name: string, role: string, lost: string}) => void)[]} */
const visitorListeners = [];

/** @type {Status | null} */
let last = null;
let lastMs = Number.NEGATIVE_INFINITY;
let openedMs = performance.now();
let heardMs = performance.now();
let retryMs = FIRST_RETRY_MS;
let why = "";
let whyKnown = false;
let live = false;
let leaving = false;
/** @type {WebSocket | null} */
let socket = null;

/** @param {(status: Status, ageS: number) => void} listener */
export function onStatus(listener) {
  statusListeners.push(listener);
  if (live && last) listener(last, ageS());
}

/** @param {(none: NoData) => void} listener */
export function onNoData(listener) {
  noDataListeners.push(listener);
}

/** @param {(visitor: {name: string, role: string, lost: string}) => void} listener */
export function onVisitor(listener) {
  visitorListeners.push(listener);
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
  window.addEventListener("pagehide", () => { leaving = true; });
  window.addEventListener("pageshow", (event) => {
    leaving = false;
    if (event.persisted) location.reload();
  });
  connect();
  setInterval(look, 250);
}

function connect() {
  const scheme = location.protocol === "https:" ? "wss:" : "ws:";
  openedMs = performance.now();
  heardMs = openedMs;
  const mine = new WebSocket(`${scheme}//${location.host}/live`);
  let opened = false;
  socket = mine;
  mine.addEventListener("open", () => { opened = true; });
  mine.addEventListener("message", (event) => hear(String(event.data)));
  mine.addEventListener("close", () => {
    if (socket !== mine || leaving) return;
    socket = null;
    whyKnown = false;
    if (!opened) void lookAround();
    setTimeout(connect, retryMs);
    retryMs = Math.min(LONGEST_RETRY_MS, 1.5 * retryMs);
  });
}

/** Ask why there is no connection: a server that began anew knows the log-in no more. */
async function lookAround() {
  try {
    const answer = await fetch(location.pathname, { redirect: "manual", cache: "no-store" });
    if (answer.type === "opaqueredirect") location.reload();
  } catch {
    // it is not there; the next attempt follows
  }
}

/** @param {string} text */
function hear(text) {
  heardMs = performance.now();
  retryMs = FIRST_RETRY_MS;
  const message = JSON.parse(text);
  if (message.kind === "status") {
    last = message.status;
    lastMs = performance.now() - 1000 * message.age_s;
    live = true;
    for (const listener of statusListeners) listener(message.status, message.age_s);
  } else if (message.kind === "no_data") {
    why = message.text;
    whyKnown = true;
    tellNone(message.since);
  } else if (message.kind === "hello") {
    if (isOld(message)) {
      location.reload();
      return;
    }
    for (const listener of visitorListeners) listener(message);
  } else if (message.kind === "ended" || message.kind === "role") {
    leaveNotice(message.text);
    location.reload();
  }
}

/**
 * Whether this page was made by another run of the server, or for somebody who is no more.
 * @param {{program: string, name: string, role: string, lost: string}} hello
 */
function isOld(hello) {
  const { program, name, role } = document.body.dataset;
  if (hello.program !== program) {
    if (name && !hello.name) leaveNotice(word("login.started_anew"));
    return true;
  }
  if (hello.name === name && hello.role === role) return false;
  if (hello.lost) leaveNotice(hello.lost);
  return true;
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
  const silent = performance.now() - heardMs > SILENT_MS;
  if (silent && socket) {
    const dead = socket;
    socket = null;
    whyKnown = false;
    dead.close();
    connect();
  }
  const waited = last ? ageS() : (performance.now() - openedMs) / 1000;
  if (waited > longestAgeS()) {
    if (!whyKnown) why = word("common.no_connection_to_screen");
    tellNone(last?.utc ?? null);
  }
}

/** @param {string | null} since */
function tellNone(since) {
  live = false;
  for (const listener of noDataListeners) listener({ text: why, since });
}

/**
 * The words of a page without fresh values.
 * @param {NoData} none
 */
export function noDataWords(none) {
  if (none.since === null) return `${word("common.no_data")}. ${none.text}`;
  const day = new Date(none.since).toDateString() === new Date().toDateString();
  const time = day ? clock(none.since) : moment(none.since);
  return `${word("common.no_data_since", { time })}. ${none.text}`;
}
