// @ts-check
/** Every sensor and its redundant one: what the templates leave open, noise and the last minutes. */
import { asked, Refused } from "../asked.js";
import { drawChart } from "../chart/chart.js";
import { say } from "../elements.js";
import { fillLive } from "./cells.js";
import { onStatus } from "../live.js";
import { number, shortNames, word } from "../words.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */

const REFRESH_MS = 5000;
const SHOWN_MS = 300000;

/** @type {Data} noise and last minutes by name */
let values = {};
let askedMs = Number.NEGATIVE_INFINITY;
const cards = /** @type {HTMLElement[]} */ ([...document.querySelectorAll(".sensor")]);
/** @type {Set<HTMLElement>} */
const seen = new Set();
const watching = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    const card = /** @type {HTMLElement} */ (target.parentElement);
    if (isIntersecting) seen.add(card);
    else seen.delete(card);
    if (isIntersecting) draw(card);
  }
});

for (const card of cards) watching.observe(chartOf(card));
onStatus((status) => {
  fillLive(status);
  for (const card of cards) showApart(card, status);
  if (performance.now() - askedMs >= REFRESH_MS) void refresh();
});

async function refresh() {
  askedMs = Number.POSITIVE_INFINITY;
  try {
    const told = await asked("/sensors/values");
    values = told.values;
    for (const cell of /** @type {NodeListOf<HTMLElement>} */ (
      document.querySelectorAll("[data-noise]"))) {
      const { noise_k: noise, count } = values[cell.dataset.noise ?? ""];
      const few = word("sensors-not_yet", { count, least: told.least });
      say(cell, noise === null ? few : number(noise, 3));
    }
    seen.forEach(draw);
  } catch (error) {
    if (!(error instanceof Refused)) throw error; // asked again in a while
  } finally {
    askedMs = performance.now();
  }
}

/** A sensor and its redundant one. @param {HTMLElement} card */
function namesOf({ dataset: { channel = "", redundant } }) {
  return redundant ? [channel, redundant] : [channel];
}

/** How far a sensor is from its redundant one. @param {HTMLElement} card @param {Data} status */
function showApart(card, { inputs, signals }) {
  const [own, redundant] = namesOf(card).map((name) => (inputs[name] ?? signals[name])?.read);
  const known = typeof own === "number" && typeof redundant === "number";
  const apart = number(known ? Math.abs(own - redundant) : null, 2);
  const most = number(Number(card.dataset.most), 1);
  say(card.querySelector(".apart"), word("sensors-difference", { apart, most }));
}

/** @param {HTMLElement} card */
function chartOf(card) {
  return /** @type {HTMLElement} */ (card.querySelector(".sensor-chart"));
}

/** @param {HTMLElement} card */
function draw(card) {
  const lines = namesOf(card).map((name, k) => {
    const { t = [], y = [] } = values[name] ?? {};
    return { name: word(k ? "sensors-redundant" : "sensors-sensor"), unit: "°C", x: t, y };
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
