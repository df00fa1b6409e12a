// @ts-check
/**
 * Charts of all pages, drawn by Plotly from the installed package.
 *
 * Lines differ by dash and marker, not by colour alone; null stays a gap; UTC comes in and local
 * time is written; legend and tools stand beside the data, and a tap shows the values there.
 */
import { showLegend } from "./legend.js";
import { clustersOf, nameMarks } from "./marks.js";
import { colours, layoutOf, lookOf, tracesOf } from "./plot.js";
import { milliseconds, plotlyLocale } from "./time.js";
import { button, made, style } from "../elements.js";
import { number, pageLocale, word } from "../words.js";

/**
 * @typedef {string | number | Date} X ISO time, milliseconds since 1970 with `time`, or a number
 * @typedef {object} Line
 * @property {string} name
 * @property {X[]} x
 * @property {(number | null)[]} y
 * @property {"left" | "right"} [axis]
 * @property {string} [unit]
 * @property {string} [dash] solid, dash, dot, dashdot, longdash, longdashdot; else by its place
 * @property {string} [marker] circle, square, diamond, triangle-up, cross, x, none
 * @property {number} [markers] most markers along the line; 12
 * @property {boolean} [stepped] held from value to value
 * @property {boolean} [pointsOnly] markers without a line
 * @property {number} [color] number of the colour, 1 to 6; else by its place
 * @property {number} [digits] decimals in the legend
 * @property {(number | null)[]} [low] lower edge of a band around the line
 * @property {(number | null)[]} [high] upper edge of it
 * @property {boolean} [unlisted] whether the legend leaves it out
 *
 * @typedef {object} Mark
 * @property {X} x
 * @property {string} text
 * @property {string} [kind] `alarm` stands out; `request` stands in a row of its own, with numbers
 * @property {number} [rank] what has no room goes by it, the largest first; 1
 *
 * @typedef {object} Band
 * @property {number | null} [low] lower edge; a band with one edge is a limit, drawn as a line
 * @property {number | null} [high] upper edge
 * @property {"left" | "right"} [axis]
 * @property {string} [text]
 *
 * @typedef {object} Chart
 * @property {Line[]} lines
 * @property {Mark[]} [marks]
 * @property {Band[]} [bands]
 * @property {string} [xTitle]
 * @property {string} [yTitle]
 * @property {string} [rightTitle]
 * @property {boolean} [still] no tools, no zoom: for a page that is only looked at
 * @property {boolean} [time] whether x is a time; else judged by the first x
 * @property {X} [first] begin of the x axis
 * @property {X} [last] end of it
 * @property {number} [leastSpan] the left axis shows at least so much: noise stays small
 * @property {number} [marksListed] marks with a letter, the weightiest ones; 8 in a still chart
 * @property {string} [label] what the chart shows, for who cannot see it
 * @property {(span: {first: number, last: number} | null) => void} [onSpan] the span was changed
 *   by a person [ms, or the axis' unit]; null: all of it
 *
 * @typedef {import("./marks.js").Cluster} Cluster
 * @typedef {{element: HTMLElement, chart: Chart, view: [number, number] | null,
 *   at: number | null, wired: boolean, plot: HTMLElement, tools: HTMLElement,
 *   legend: HTMLElement, awaited: boolean, seen: boolean, size: string,
 *   watcher?: ResizeObserver}} Drawn
 */

const DRAWN = /** @type {WeakMap<HTMLElement, Drawn>} */ (new WeakMap());
const SHOWN = /** @type {Set<HTMLElement>} */ (new Set());
const TEXTS_SHOWN = 3;
let watched = false; // whether charts follow the page's colours
const plotly = () => /** @type {any} */ (globalThis).Plotly;

/**
 * Draw a chart, or draw it anew.
 * @param {HTMLElement} element takes the height that its style gives it
 * @param {Chart} chart
 */
export function drawChart(element, chart) {
  const drawn = DRAWN.get(element) ?? begin(element);
  const { first, last } = drawn.chart;
  const same = String(first) === String(chart.first) && String(last) === String(chart.last);
  if (!same) drawn.view = null;
  drawn.chart = chart;
  draw(drawn);
}

/** @param {HTMLElement} element @returns {Drawn} */
function begin(element) {
  style("chart/chart.css");
  const plot = made("div", "", "chart-plot");
  const tools = made("div", "", "chart-tools");
  const legend = made("ul", "", "chart-legend");
  element.classList.add("chart");
  element.replaceChildren(tools, plot, legend);
  const chart = { lines: [] };
  const size = { view: null, at: null, wired: false, awaited: false, seen: false, size: "" };
  /** @type {Drawn} */
  const drawn = { element, chart, plot, tools, legend, ...size };
  DRAWN.set(element, drawn);
  watchTheme();
  dropDetached();
  SHOWN.add(element);
  drawn.watcher = new ResizeObserver(() => {
    const now = `${plot.clientWidth} ${plot.clientHeight}`;
    if (now !== drawn.size) later(drawn);
  });
  drawn.watcher.observe(plot);
  return drawn;
}

/** Forget charts that left the page; one that comes back to it is begun anew. */
function dropDetached() {
  for (const element of SHOWN) {
    const drawn = DRAWN.get(element);
    if (element.isConnected || !drawn?.seen) continue; // one that was not seen yet may still come
    drawn.watcher?.disconnect();
    if (drawn.wired) plotly().purge(drawn.plot);
    DRAWN.delete(element);
    SHOWN.delete(element);
  }
}

function watchTheme() {
  if (watched) return;
  watched = true;
  const again = () => {
    dropDetached();
    for (const element of SHOWN) later(/** @type {Drawn} */ (DRAWN.get(element)));
  };
  document.addEventListener("theme", again);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
}

/** @param {Drawn} drawn */
function later(drawn) {
  if (drawn.awaited) return;
  drawn.awaited = true;
  requestAnimationFrame(() => {
    drawn.awaited = false;
    if (DRAWN.get(drawn.element) === drawn) draw(drawn);
  });
}

/** @param {Drawn} drawn */
function draw(drawn) {
  const { plot, chart } = drawn;
  drawn.seen ||= drawn.element.isConnected;
  if (!plotly()) {
    plot.textContent = word("chart-missing");
    return;
  }
  const paint = colours(plot);
  const axis = axisOf(drawn);
  const marks = clustersOf(drawn, axis);
  showTools(drawn, axis);
  legend(drawn, axis, marks, paint);
  const [width, height] = [plot.clientWidth, plot.clientHeight];
  drawn.size = `${width} ${height}`;
  if (width < 40 || height < 40) return;
  plot.setAttribute("role", "img");
  plot.setAttribute("aria-label", chart.label ?? chart.yTitle ?? "");
  plotly().register(plotlyLocale(pageLocale));
  const traces = tracesOf(chart, axis, paint);
  const layout = layoutOf(drawn, axis, marks, paint, [width, height]);
  plotly().react(plot, traces, layout, {
    displayModeBar: false,
    displaylogo: false,
    doubleClick: false,
    staticPlot: Boolean(chart.still),
    locale: pageLocale,
    showTips: false,
  });
  if (!drawn.wired) wire(drawn);
}

// ---- axis ----------------------------------------------------------------------------------

/**
 * @typedef {{time: boolean, first: number, last: number, unknown: boolean, empty: boolean,
 *   lines: number[][]}} Axis
 * @param {Drawn} drawn
 * @returns {Axis}
 */
function axisOf({ chart, view }) {
  const some = chart.lines.find((line) => line.x.length)?.x[0] ?? chart.first;
  const time = chart.time ?? (typeof some === "string" || some instanceof Date);
  const lines = chart.lines.map((line) => line.x.map(milliseconds));
  const all = wholeSpan(chart, lines);
  const [first, last] = view ?? all ?? [0, 1];
  const empty = !chart.lines.some((line) => line.y.some((y) => y !== null));
  return { time, first, last, unknown: !view && !all, empty, lines };
}

/** @param {Chart} chart @param {number[][]} lines @returns {[number, number] | null} */
function wholeSpan(chart, lines) {
  let first = chart.first === undefined ? Infinity : milliseconds(chart.first);
  let last = chart.last === undefined ? -Infinity : milliseconds(chart.last);
  for (const x of lines) {
    for (const at of x) {
      if (chart.first === undefined && at < first) first = at;
      if (chart.last === undefined && at > last) last = at;
    }
  }
  if (!Number.isFinite(first) || !Number.isFinite(last)) return null;
  return last > first ? [first, last] : [first - 1, first + 1];
}

// ---- legend and tools ------------------------------------------------------------------------

/**
 * @param {Drawn} drawn
 * @param {Axis} axis
 * @param {Cluster[]} marks
 * @param {Record<string, string>} paint
 */
function legend(drawn, axis, marks, paint) {
  let named = marks.filter((mark) => mark.letter).length;
  showLegend(drawn.legend, entriesOf(drawn, axis, marks, paint));
  while (drawn.chart.still && named > 0 && overflows(drawn.legend)) {
    named -= 1;
    nameMarks(marks, named);
    showLegend(drawn.legend, entriesOf(drawn, axis, marks, paint));
  }
}

/** @param {HTMLElement} list */
function overflows(list) {
  const room = list.getBoundingClientRect();
  return [...list.children].some((entry) => {
    const { left, bottom } = entry.getBoundingClientRect();
    return left > room.right - 8 || bottom > room.bottom + 1;
  });
}

/**
 * @param {Drawn} drawn
 * @param {Axis} axis
 * @param {Cluster[]} marks
 * @param {Record<string, string>} paint
 * @returns {import("./legend.js").Entry[]}
 */
function entriesOf(drawn, axis, marks, paint) {
  const entries = /** @type {import("./legend.js").Entry[]} */ ([]);
  drawn.chart.lines.forEach((line, k) => {
    const look = lookOf(line, k);
    const text = line.unit ? `${line.name} [${line.unit}]` : line.name;
    const value = valueAt(drawn, line, axis.lines[k] ?? []);
    const color = paint[look.color] ?? "";
    if (!line.unlisted) entries.push({ kind: "line", text, value, ...look, color });
  });
  for (const { text, low, high } of drawn.chart.bands ?? []) {
    const ranged = typeof low === "number" && typeof high === "number" && low !== high;
    const color = (ranged ? paint.muted : paint.text) ?? "";
    if (text) entries.push({ kind: ranged ? "band" : "limit", text, color });
  }
  const most = drawn.chart.still ? 1 : TEXTS_SHOWN;
  for (const { letter, texts, grave } of marks) {
    const some = texts.slice(0, most).join("; ");
    const more = texts.length - most;
    const text = more > 0 && most > 1 ? word("chart-and_more", { text: some, count: more }) : some;
    const value = more > 0 && most === 1 ? `+${more}` : "";
    if (letter) entries.push({ kind: "mark", letter, text, value, grave });
  }
  const left = marks.filter((mark) => !mark.letter).flatMap((mark) => mark.marks).length;
  const others = drawn.chart.still ? `+${left}` : word("chart-and_others", { count: left });
  if (left) entries.push({ kind: "more", text: others });
  return entries;
}

/** @param {Drawn} drawn @param {Line} line @param {number[]} x */
function valueAt(drawn, line, x) {
  const at = drawn.at;
  if (at === null || !x.length) return "";
  let nearest = 0;
  x.forEach((value, k) => {
    if (Math.abs(value - at) < Math.abs((x[nearest] ?? 0) - at)) nearest = k;
  });
  return number(line.y[nearest] ?? null, line.digits ?? 1);
}

/** @param {Drawn} drawn @param {Axis} axis */
function showTools(drawn, axis) {
  const { chart, tools } = drawn;
  tools.hidden = Boolean(chart.still);
  if (chart.still || tools.childElementCount) return;
  /** @param {string} sign @param {string} name @param {(now: Axis, span: number) => void} move */
  const tool = (sign, name, move) => {
    const found = button(sign, () => {
      const now = axisOf(drawn);
      move(now, now.last - now.first);
    }, name);
    found.title = name;
    tools.append(found);
  };
  tool("◀", word("chart-earlier"), ({ first, last }, span) =>
    show(drawn, [first - span / 2, last - span / 2]),
  );
  tool("▶", word("chart-later"), ({ first, last }, span) =>
    show(drawn, [first + span / 2, last + span / 2]),
  );
  tool("−", word("chart-zoom_out"), ({ first, last }, span) =>
    show(drawn, [first - span / 2, last + span / 2]),
  );
  tool("+", word("chart-zoom_in"), ({ first, last }, span) =>
    show(drawn, [first + span / 4, last - span / 4]),
  );
  tool(word("chart-all"), word("chart-show_all"), () => show(drawn, null));
}

/** @param {Drawn} drawn @param {[number, number] | null} view */
function show(drawn, view) {
  if (view && !(view[1] - view[0] > 1e-6)) return;
  drawn.view = view;
  later(drawn);
  drawn.chart.onSpan?.(view && { first: view[0], last: view[1] });
}

/** @param {Drawn} drawn */
function wire(drawn) {
  drawn.wired = true;
  const plot = /** @type {any} */ (drawn.plot);
  plot.on("plotly_relayout", (/** @type {Record<string, number>} */ change) => {
    const [first, last] = [change["xaxis.range[0]"], change["xaxis.range[1]"]];
    if (typeof first === "number" && typeof last === "number") show(drawn, [first, last]);
  });
  const point = (/** @type {any} */ event) => {
    drawn.at = event.points?.[0]?.x ?? null;
    const axis = axisOf(drawn);
    legend(drawn, axis, clustersOf(drawn, axis), colours(drawn.plot));
  };
  plot.on("plotly_hover", point);
  plot.on("plotly_click", point);
}
