// @ts-check
/** Every sensor and its redundant one: what the templates leave open, noise and the last minutes. */
import { drawChart } from "../chart/chart.js";
import { say } from "../elements.js";
import { fillLive } from "./cells.js";
import { onStatus } from "../live.js";
import { addPoint, withGaps } from "../live_points.js";
import { number, shortNames, word } from "../words.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */
/** @typedef {import("../live_points.js").Points} Past */

const REFRESH_MS = 5000;
const SHOWN_MS = 300000;

/** @type {Map<string, Past>} */
const past = new Map();
/** @type {Data} */
let noise = {};
let least = 0;
let askedMs = Number.NEGATIVE_INFINITY;
let drawnMs = Number.NEGATIVE_INFINITY;
let asking = false;
let gapMs = 5000;
const cards = /** @type {HTMLElement[]} */ ([...document.querySelectorAll(".sensor")]);
/** @type {Set<HTMLElement>} */
const seen = new Set();
const watching = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    const card = /** @type {HTMLElement} */ (target.parentElement);
    if (isIntersecting && !seen.has(card)) draw(card);
    if (isIntersecting) seen.add(card);
    else seen.delete(card);
  }
});

for (const card of cards) watching.observe(chartOf(card));
onStatus((status) => {
  const now = performance.now();
  gapMs = Math.max(5000, 3000 * status.cycle_s);
  if (now - askedMs >= REFRESH_MS && !asking) void refresh();
  remember(status);
  fillLive(status);
  for (const card of cards) show(card, status);
  if (now - drawnMs >= REFRESH_MS) {
    drawnMs = now;
    seen.forEach(draw);
  }
});

async function refresh() {
  asking = true;
  askedMs = performance.now();
  try {
    const answer = await fetch("/sensors/values");
    if (!answer.ok) return;
    const values = await answer.json();
    least = values.least;
    noise = values.values;
    for (const [name, found] of Object.entries(noise)) seed(name, found);
  } catch (error) {
    if (!(error instanceof TypeError)) throw error; // not reached: asked again with the next status
  } finally {
    asking = false;
  }
}

/**
 * Take the minutes before this page was opened; what it has seen itself stays.
 * @param {string} name
 * @param {Data} found
 */
function seed(name, found) {
  const own = past.get(name) ?? { t: [], y: [] };
  const first = own.t[0] ?? Number.POSITIVE_INFINITY;
  const before = found.t.filter((/** @type {number} */ t) => t < first - 500).length;
  if (!before) return;
  past.set(name, {
    t: [...found.t.slice(0, before), ...own.t],
    y: [...found.y.slice(0, before), ...own.y],
  });
  drawnMs = Number.NEGATIVE_INFINITY;
}

/** @param {Data} status */
function remember(status) {
  const at = Date.parse(status.utc);
  for (const card of cards) {
    for (const name of namesOf(card)) {
      const own = past.get(name) ?? { t: [], y: [] };
      addPoint(own, at, sampleOf(status, name)?.read ?? null, SHOWN_MS);
      past.set(name, own);
    }
  }
}

/** A sensor and its redundant one. @param {HTMLElement} card */
function namesOf({ dataset: { channel = "", redundant } }) {
  return redundant ? [channel, redundant] : [channel];
}

/** @param {Data} status @param {string} name */
function sampleOf(status, name) {
  return status.inputs[name] ?? status.signals[name] ?? null;
}

/** How much a sensor scatters, and how far it is from its redundant one. @param {HTMLElement} card @param {Data} status */
function show(card, status) {
  for (const cell of /** @type {NodeListOf<HTMLElement>} */ (card.querySelectorAll("[data-noise]"))) {
    say(cell, noiseWords(noise[cell.dataset.noise ?? ""]));
  }
  const [own, redundant] = namesOf(card).map((name) => sampleOf(status, name)?.read ?? null);
  const known = typeof own === "number" && typeof redundant === "number";
  const apart = number(known ? Math.abs(own - redundant) : null, 2);
  const most = number(Number(card.dataset.most), 1);
  say(card.querySelector(".apart"), word("sensors-difference", { apart, most }));
}

/** @param {Data | undefined} found */
function noiseWords(found) {
  if (!found || found.noise_k === null) {
    return word("sensors-not_yet", { count: found?.count ?? 0, least });
  }
  return number(found.noise_k, 3);
}

/** @param {HTMLElement} card */
function chartOf(card) {
  return /** @type {HTMLElement} */ (card.querySelector(".sensor-chart"));
}

/** @param {HTMLElement} card */
function draw(card) {
  const lines = namesOf(card).map((name, k) => {
    const own = past.get(name) ?? { t: [], y: [] };
    const text = k ? word("sensors-redundant") : word("sensors-sensor");
    return { name: text, unit: "°C", ...withGaps(own, gapMs) };
  });
  const last = Math.max(...lines.map((line) => line.x.at(-1) ?? 0)) || Date.now();
  drawChart(chartOf(card), {
    lines,
    time: true,
    first: last - SHOWN_MS,
    last,
    leastSpan: 1,
    still: true,
    yTitle: "°C",
    label: word("sensors-chart_label", { channel: shortNames(card.dataset.channel ?? "") }),
  });
}
