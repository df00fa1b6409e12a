// @ts-check
/** Every sensor and its redundant one: raw, judged, in its range; noise and the last minutes. */
import { drawChart } from "../chart/chart.js";
import { byId, made, say } from "../elements.js";
import { fillTable, rangeBar, showRange, showVerdict, verdict } from "./engineer.js";
import { onStatus } from "../live.js";
import { addPoint, withGaps } from "../live_points.js";
import { duration, number, shortNames, word } from "../words.js";

/** @typedef {Record<string, any>} Data what the server says, as it comes */
/** @typedef {import("../live_points.js").Points} Past */

const REFRESH_MS = 5000;
const SHOWN_MS = 300000;
const facts = JSON.parse(byId("facts").textContent ?? "{}");

/** @type {Map<string, Past>} */
const past = new Map();
/** @type {Data} */
let noise = {};
let least = 0;
let askedMs = Number.NEGATIVE_INFINITY;
let drawnMs = Number.NEGATIVE_INFINITY;
let asking = false;
let gapMs = 5000;
/** @type {((status: Data) => void)[]} */
const live = [];
/** @type {{element: HTMLElement, seen: boolean, channel: Data}[]} */
const charts = [];
/** @type {string[]} */
let signalsShown = [];

for (const channel of facts.channels) byId("sensors").append(card(channel));
showConditions();
onStatus((status) => {
  const now = performance.now();
  gapMs = Math.max(5000, 3000 * status.cycle_s);
  if (now - askedMs >= REFRESH_MS && !asking) void refresh();
  remember(status);
  for (const show of live) show(status);
  showOthers(status);
  if (now - drawnMs >= REFRESH_MS) {
    drawnMs = now;
    for (const one of charts) if (one.seen) draw(one.element, one.channel);
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
  for (const channel of facts.channels) {
    for (const name of namesOf(channel)) {
      const own = past.get(name) ?? { t: [], y: [] };
      addPoint(own, at, sampleOf(status, name)?.read ?? null, SHOWN_MS);
      past.set(name, own);
    }
  }
}

/** @param {Data} channel @returns {string[]} */
function namesOf(channel) {
  return channel.redundant ? [channel.name, channel.redundant] : [channel.name];
}

/** @param {Data} status @param {string} name */
function sampleOf(status, name) {
  return status.inputs[name] ?? status.signals[name] ?? null;
}

// ---- one sensor ------------------------------------------------------------------------------

/** @param {Data} channel */
function card(channel) {
  const section = made("section", "", "panel sensor");
  section.dataset.channel = channel.name;
  const heading = made("h2");
  const value = made("b", "–", "live");
  heading.append(made("span", shortNames(channel.name)), value);
  const [said, bar, chart] = [verdict(), rangeBar(), made("div", "", "sensor-chart")];
  bar.classList.add("wide-range");
  const limits = rules(channel.rules, channel.redundant);
  section.append(heading, said, readings(channel), bar, chart, limits);
  live.push((status) => {
    const input = status.inputs[channel.name] ?? null;
    const raw = sampleOf(status, channel.name)?.read ?? null;
    const given = input ? input.value_c : raw;
    say(value, `${number(given, 1)} °C`);
    const quality = input ? input.quality_said : word("sensors-not_in_model");
    showVerdict(said, input ? input.quality === "good" : "unused", quality);
    const { lowest_c: low, highest_c: high } = channel.rules;
    showRange(bar, { low, high, value: raw });
  });
  watch(chart, channel);
  return section;
}

/** @param {HTMLElement} element @param {Data} channel */
function watch(element, channel) {
  const one = { element, seen: false, channel };
  charts.push(one);
  new IntersectionObserver((entries) => {
    const seen = entries.some((entry) => entry.isIntersecting);
    if (seen && !one.seen) draw(element, channel);
    one.seen = seen;
  }).observe(element);
}

/** @param {HTMLElement} element @param {Data} channel */
function draw(element, channel) {
  const lines = namesOf(channel).map((name, k) => {
    const own = past.get(name) ?? { t: [], y: [] };
    const text = k ? word("sensors-redundant") : word("sensors-sensor");
    return { name: text, unit: "°C", ...withGaps(own, gapMs) };
  });
  const last = Math.max(...lines.map((line) => line.x.at(-1) ?? 0)) || Date.now();
  drawChart(element, {
    lines,
    time: true,
    first: last - SHOWN_MS,
    last,
    leastSpan: 1,
    still: true,
    yTitle: "°C",
    label: word("sensors-chart_label", { channel: shortNames(channel.name) }),
  });
}

/** @param {Data} channel */
function readings(channel) {
  const table = made("table");
  const cells = namesOf(channel).map((name, k) => {
    const [raw, state, age, scatter] = [0, 1, 2, 3].map(() => made("span", "–", "live"));
    live.push((status) => {
      const sample = sampleOf(status, name);
      if (raw) say(raw, number(sample?.read ?? null, 2));
      if (state) say(state, sample?.status ?? "–");
      if (age) say(age, number(sample?.age_s ?? null, 1));
      if (scatter) say(scatter, noiseWords(noise[name]));
    });
    const title = k ? word("sensors-redundant") : word("sensors-sensor");
    return [title, { number: raw ?? "" }, state ?? "", { number: age ?? "" }, scatter ?? ""];
  });
  const difference = made("span", "–", "live");
  const body = made("div");
  fillTable(
    table,
    [
      "",
      word("sensors-raw"),
      word("sensors-status"),
      word("sensors-age"),
      word("sensors-noise"),
    ],
    cells,
  );
  body.append(table);
  if (!channel.redundant) return body;
  live.push((status) => {
    const [own, redundant] = namesOf(channel).map((name) => sampleOf(status, name)?.read ?? null);
    const known = typeof own === "number" && typeof redundant === "number";
    const apart = number(known ? Math.abs(own - redundant) : null, 2);
    const most = number(channel.rules.largest_difference_k, 1);
    say(difference, word("sensors-difference", { apart, most }));
  });
  body.append(difference);
  return body;
}

/** @param {Data | undefined} found */
function noiseWords(found) {
  if (!found || found.noise_k === null) {
    return word("sensors-not_yet", { count: found?.count ?? 0, least });
  }
  return number(found.noise_k, 3);
}

/** @param {Data} rules @param {string | null} redundant */
function rules(rules, redundant) {
  const list = made("dl", "", "facts rules");
  const add = (/** @type {string} */ name, /** @type {string} */ text) =>
    list.append(made("dt", name), made("dd", text));
  const range = { lowest: number(rules.lowest_c, 1), highest: number(rules.highest_c, 1) };
  add(word("sensors-plausible"), word("sensors-from_to", range));
  add(
    word("sensors-fastest"),
    word("sensors-fastest_said", {
      rate: number(60 * rules.largest_rate_k_per_s, 1),
      step: number(rules.step_k, 1),
    }),
  );
  add(
    word("sensors-oldest"),
    rules.time_stamp_required
      ? duration(rules.longest_age_s)
      : word("sensors-oldest_unstamped", { time: duration(rules.longest_age_s) }),
  );
  add(
    word("sensors-frozen"),
    rules.frozen_s > 0
      ? word("sensors-frozen_after", { time: duration(rules.frozen_s) })
      : word("sensors-may_stand_still"),
  );
  if (!redundant) add(word("sensors-redundant"), word("sensors-no_redundant"));
  return list;
}

// ---- conditions and everything else that is read ---------------------------------------------

function showConditions() {
  const rows = facts.interlocks.map((/** @type {Data} */ one) => {
    const said = verdict();
    live.push((status) => {
      const flag = flagOf(status.signals[one.signal]);
      const met = flag === null ? null : flag === one.met;
      const words = met === null ? word("sensors-not_read") : metWords(met);
      showVerdict(said, met === true, words);
    });
    return [one.name, word("sensors-interlock"), said];
  });
  if (facts.other_compensation !== null) {
    const said = verdict();
    live.push((status) => {
      const flag = flagOf(status.signals.other_compensation);
      const active = flag === null ? null : flag === facts.other_compensation;
      showVerdict(said, active === null ? null : !active, activeWords(active));
    });
    rows.push([word("sensors-other_compensation"), word("sensors-flag"), said]);
  }
  const diameter = made("span", "–", "live");
  live.push((status) => {
    const known = status.diameter_mm !== null;
    say(diameter, known ? `${number(status.diameter_mm, 1)} mm` : word("sensors-tool_point"));
  });
  const read = Boolean(facts.diameter_read);
  const origin = read ? word("sensors-diameter_read") : word("sensors-diameter_asked");
  rows.push([word("sensors-diameter"), origin, diameter]);
  fillTable(
    byId("conditions"),
    [word("sensors-name"), word("sensors-kind"), word("sensors-now")],
    rows,
  );
}

/** @param {Data | undefined} sample @returns {boolean | null} */
function flagOf(sample) {
  return sample?.good && sample.read !== null ? sample.read !== 0 : null;
}

/** @param {boolean} met */
function metWords(met) {
  return met ? word("sensors-met") : word("sensors-not_met");
}

/** @param {boolean | null} active */
function activeWords(active) {
  if (active === null) return word("sensors-not_read");
  return active ? word("sensors-active") : word("sensors-not_active");
}

/** @param {Data} status */
function showOthers(status) {
  const known = new Set(facts.channels.flatMap(namesOf));
  for (const one of facts.interlocks) known.add(one.signal);
  known.add("other_compensation");
  const names = Object.keys(status.signals).filter((name) => !known.has(name));
  byId("others").hidden = names.length === 0;
  if (names.join("\n") !== signalsShown.join("\n")) {
    signalsShown = names;
    fillTable(
      byId("other-table"),
      [word("sensors-name"), word("sensors-raw_any"), word("sensors-status"), word("sensors-age")],
      names.map((name) => {
        const [value, state, age] = [0, 1, 2].map(() => made("span", "–", "live"));
        return [shortNames(name), { number: value ?? "" }, state ?? "", { number: age ?? "" }];
      }),
    );
  }
  byId("other-table").querySelectorAll("tbody tr").forEach((row, k) => {
    const sample = status.signals[names[k] ?? ""];
    const [value, state, age] = /** @type {HTMLElement[]} */ ([...row.querySelectorAll("span")]);
    if (value) say(value, number(sample?.read ?? null, 2));
    if (state) say(state, sample?.status ?? "–");
    if (age) say(age, number(sample?.age_s ?? null, 1));
  });
}
