// @ts-check
/**
 * Charts of all pages, drawn by Plotly from the installed package.
 *
 * Lines differ by dash and marker, not by colour alone; null stays a gap; UTC comes in and local
 * time is written; legend and tools stand beside the data, and a tap shows the values there.
 */
import { DASHES, MARKERS, showLegend } from "./chart_legend.js";
import { milliseconds, plotlyLocale, timeTicks, zoneName } from "./chart_time.js";
import { number, pageLocale, word } from "./words.js";

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
 * @typedef {{chart: Chart, view: [number, number] | null, at: number | null, wired: boolean,
 *   plot: HTMLElement, tools: HTMLElement, legend: HTMLElement, awaited: boolean,
 *   size: string}} Drawn
 */

const DRAWN = /** @type {WeakMap<HTMLElement, Drawn>} */ (new WeakMap());
const SHOWN = /** @type {Set<HTMLElement>} */ (new Set());
const MARK_ROOM_PX = 24;
const TICK_ROOM_PX = 84;
const MOST_MARKERS = 12;
const STILL_MARKS = 8;
const TEXTS_SHOWN = 3;
const BLANK = { range: [0, 1], showticklabels: false };
const plotly = () => /** @type {any} */ (globalThis).Plotly;
const language = () => document.documentElement.lang || "en";

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
  style();
  const plot = document.createElement("div");
  const tools = document.createElement("div");
  const legend = document.createElement("ul");
  plot.className = "chart-plot";
  tools.className = "chart-tools";
  legend.className = "chart-legend";
  element.classList.add("chart");
  element.replaceChildren(tools, plot, legend);
  const chart = { lines: [] };
  const size = { view: null, at: null, wired: false, awaited: false, size: "" };
  const drawn = { chart, plot, tools, legend, ...size };
  DRAWN.set(element, drawn);
  if (SHOWN.size === 0) watchTheme();
  SHOWN.add(element);
  new ResizeObserver(() => {
    const now = `${plot.clientWidth} ${plot.clientHeight}`;
    if (now !== drawn.size) later(drawn);
  }).observe(plot);
  return drawn;
}

function style() {
  if (document.querySelector('link[href*="chart.css"]')) return;
  const link = document.createElement("link");
  link.rel = "stylesheet";
  link.href = new URL("./chart.css", import.meta.url).href;
  document.head.append(link);
}

function watchTheme() {
  const again = () => {
    for (const element of SHOWN) {
      const drawn = DRAWN.get(element);
      if (drawn && element.isConnected) later(drawn);
      else SHOWN.delete(element);
    }
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
    draw(drawn);
  });
}

/** @param {Drawn} drawn */
function draw(drawn) {
  const { plot, chart } = drawn;
  if (!plotly()) {
    plot.textContent = word("chart.missing");
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
  if (language() !== "en") plotly().register(plotlyLocale(language(), pageLocale));
  const traces = tracesOf(chart, axis, paint);
  const layout = layoutOf(drawn, axis, marks, paint, [width, height]);
  plotly().react(plot, traces, layout, {
    displayModeBar: false,
    displaylogo: false,
    doubleClick: false,
    staticPlot: Boolean(chart.still),
    locale: language(),
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

/** @param {Axis} axis @param {number} width */
function ticksOf(axis, width) {
  if (axis.unknown) return { tickmode: "array", tickvals: [], ticktext: [] };
  if (!axis.time) return { tickmode: "auto", nticks: Math.max(3, Math.floor(width / 64)) };
  const most = Math.floor((width - 90) / TICK_ROOM_PX);
  const { at, texts } = timeTicks(axis.first, axis.last, most, pageLocale);
  return { tickmode: "array", tickvals: at, ticktext: texts };
}

// ---- what is drawn ---------------------------------------------------------------------------

/** @param {Element} near @returns {Record<string, string>} */
function colours(near) {
  const probe = document.createElement("span");
  near.parentElement?.append(probe);
  const found = /** @type {Record<string, string>} */ ({});
  const lines = [1, 2, 3, 4, 5, 6].map((n) => `line-${n}`);
  for (const token of ["text", "muted", "soft-line", ...lines]) {
    probe.style.color = `var(--${token})`;
    found[token] = getComputedStyle(probe).color;
  }
  probe.remove();
  return found;
}

/** @param {Line} line @param {number} k */
function lookOf(line, k) {
  return {
    color: `line-${line.color ?? (k % 6) + 1}`,
    dash: line.dash ?? DASHES[k % DASHES.length] ?? "solid",
    marker: line.marker ?? MARKERS[k % MARKERS.length] ?? "circle",
  };
}

/** @param {Chart} chart @param {Axis} axis @param {Record<string, string>} paint */
function tracesOf(chart, axis, paint) {
  const traces = /** @type {object[]} */ ([]);
  chart.lines.forEach((line, k) => {
    const x = axis.lines[k] ?? [];
    const look = lookOf(line, k);
    const color = paint[look.color];
    const yaxis = line.axis === "right" ? "y2" : "y";
    const common = { type: "scatter", yaxis, hoverinfo: "skip", showlegend: false };
    if (line.low && line.high) {
      const edge = outline(x, line.low, line.high);
      const fill = { fill: "toself", fillcolor: color, opacity: 0.2 };
      traces.unshift({ ...common, ...edge, ...fill, mode: "lines", line: { width: 0 } });
    }
    const marked = look.marker !== "none" && !line.pointsOnly;
    traces.push({
      ...common,
      x,
      y: line.y,
      hoverinfo: "none",
      connectgaps: false,
      mode: line.pointsOnly ? "markers" : marked ? "lines+markers" : "lines",
      line: { color, dash: look.dash, width: 2, shape: line.stepped ? "hv" : "linear" },
      marker: {
        color,
        symbol: marked || line.pointsOnly ? look.marker.replace("none", "circle") : "circle",
        size: 8,
        maxdisplayed: marked ? line.markers ?? MOST_MARKERS : 0,
      },
    });
  });
  return traces;
}

/**
 * Return closed outlines of a band, one for each stretch without a gap.
 * @param {number[]} x
 * @param {(number | null)[]} low
 * @param {(number | null)[]} high
 */
function outline(x, low, high) {
  const edge = /** @type {{x: (number | null)[], y: (number | null)[]}} */ ({ x: [], y: [] });
  let from = 0;
  for (let k = 0; k <= x.length; k += 1) {
    const there = k < x.length && (low[k] ?? null) !== null && (high[k] ?? null) !== null;
    if (there) continue;
    if (k > from) {
      const stretch = x.slice(from, k);
      edge.x.push(...stretch, ...stretch.reverse(), null);
      edge.y.push(...high.slice(from, k), ...low.slice(from, k).reverse(), null);
    }
    from = k + 1;
  }
  return edge;
}

/**
 * @param {Drawn} drawn
 * @param {Axis} axis
 * @param {Cluster[]} marks
 * @param {Record<string, string>} paint
 * @param {[number, number]} px width and height
 */
function layoutOf({ chart }, axis, marks, paint, [width, height]) {
  const rem = parseFloat(getComputedStyle(document.documentElement).fontSize) || 16;
  const size = Math.round(rem * 0.8125);
  const right = chart.lines.some((line) => line.axis === "right");
  const common = {
    gridcolor: paint["soft-line"],
    linecolor: paint.muted,
    zerolinecolor: paint.muted,
    tickcolor: paint.muted,
    automargin: true,
    exponentformat: "none",
    hoverformat: ".1f",
  };
  const side = (/** @type {string | undefined} */ title) => ({
    ...common,
    fixedrange: true,
    ...(title ? { title: { text: plain(title), standoff: 6, font: { size } } } : {}),
    nticks: Math.max(3, Math.floor(height / 44)),
    zeroline: true,
    rangemode: "normal",
  });
  const aside = {
    side: "right",
    overlaying: "y",
    showgrid: false,
    tickmode: "auto",
    zeroline: false,
  };
  const below = chart.xTitle ?? (axis.time && !axis.unknown && !chart.still ? zoneTitle(axis) : "");
  return {
    width,
    height,
    autosize: false,
    showlegend: false,
    hovermode: "x",
    dragmode: chart.still ? false : "zoom",
    margin: { l: 8, r: right ? 8 : 16, t: marks.length ? 22 : 8, b: 8 },
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: "inherit", size, color: paint.text },
    xaxis: {
      ...common,
      ...ticksOf(axis, width),
      range: [axis.first, axis.last],
      ...(below ? { title: { text: plain(below), standoff: 4, font: { size } } } : {}),
      tickangle: 0,
      zeroline: false,
      showspikes: !chart.still,
      spikemode: "across",
      spikethickness: 1,
      spikecolor: paint.muted,
      spikedash: "solid",
    },
    yaxis: { ...side(chart.yTitle), ...(axis.empty ? BLANK : leastRange(chart)) },
    ...(right
      ? { yaxis2: { ...side(chart.rightTitle), ...aside } }
      : {}),
    shapes: [...bandShapes(chart, paint), ...marks.map((mark) => markShape(mark, paint))],
    annotations: [
      ...marks.filter((mark) => mark.letter).map((mark) => markLetter(mark, paint)),
      ...(axis.empty ? [nothing(paint)] : []),
    ],
  };
}

/** @param {Axis} axis */
function zoneTitle(axis) {
  const [begun, ended] = [axis.first, axis.last].map((at) => zoneName(at, pageLocale));
  return word("chart.local_time", { zone: begun === ended ? begun : `${begun}, ${ended}` });
}

/** Plotly reads tags in texts; names come from files. @param {string} text */
function plain(text) {
  return text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;");
}

/** @param {Chart} chart */
function leastRange(chart) {
  if (!chart.leastSpan) return {};
  let [low, high] = [Infinity, -Infinity];
  for (const line of chart.lines) {
    if (line.axis === "right") continue;
    for (const y of [...line.y, ...(line.low ?? []), ...(line.high ?? [])]) {
      if (y === null || !Number.isFinite(y)) continue;
      low = Math.min(low, y);
      high = Math.max(high, y);
    }
  }
  const lacking = chart.leastSpan - (high - low);
  if (!(lacking > 0)) return {};
  return { range: [low - lacking / 2, high + lacking / 2] };
}

/** @param {Chart} chart @param {Record<string, string>} paint */
function bandShapes(chart, paint) {
  return (chart.bands ?? []).flatMap((band) => {
    const [low, high] = [band.low ?? null, band.high ?? null];
    const common = { xref: "paper", x0: 0, x1: 1, yref: band.axis === "right" ? "y2" : "y" };
    if (low === null && high === null) return [];
    if (low !== null && high !== null && low !== high) {
      const fill = { fillcolor: paint.muted, opacity: 0.14, line: { width: 0 } };
      return [{ ...common, type: "rect", y0: low, y1: high, layer: "below", ...fill }];
    }
    const at = low ?? high;
    const line = { color: paint.text, width: 1.5, dash: "3px,3px" };
    return [{ ...common, type: "line", y0: at, y1: at, line }];
  });
}

/** @param {Record<string, string>} paint */
function nothing(paint) {
  const middle = { xref: "paper", yref: "paper", x: 0.5, y: 0.5, showarrow: false };
  return { ...middle, text: plain(word("chart.nothing")), font: { color: paint.muted } };
}

// ---- marks -----------------------------------------------------------------------------------

/**
 * @typedef {{x: number, letter: string, marks: Placed[], texts: string[], grave: boolean,
 *   rank: number, asked: boolean}} Cluster
 * @typedef {{x: number, text: string, kind?: string, rank: number}} Placed
 * @param {Drawn} drawn
 * @param {Axis} axis
 * @returns {Cluster[]} marks that have room for a letter each; neighbours share one, but what
 *   people asked for stands apart from what happened
 */
function clustersOf({ chart, plot }, axis) {
  const perPx = (axis.last - axis.first) / Math.max(100, plot.clientWidth - 90);
  const clusters = /** @type {Cluster[]} */ ([]);
  const shown = (chart.marks ?? [])
    .map((mark) => ({ ...mark, x: milliseconds(mark.x), rank: mark.rank ?? 1 }))
    .filter((mark) => mark.x >= axis.first && mark.x <= axis.last)
    .sort((a, b) => a.x - b.x);
  for (const asked of [false, true]) {
    clusters.push(...gathered(shown.filter((mark) => asked === (mark.kind === "request")),
      MARK_ROOM_PX * perPx, asked));
  }
  for (const cluster of clusters) cluster.texts = textsOf(cluster.marks, axis.time);
  const most = chart.marksListed ?? (chart.still ? STILL_MARKS : clusters.length);
  nameMarks(clusters, most);
  return clusters;
}

/**
 * Give so many marks a letter, or a number to what was asked for: the weightiest, then the latest.
 * @param {Cluster[]} clusters
 * @param {number} most
 */
function nameMarks(clusters, most) {
  const named = new Set([...clusters].sort((a, b) => a.rank - b.rank || b.x - a.x).slice(0, most));
  for (const asked of [false, true]) {
    let k = 0;
    for (const one of clusters) {
      if (one.asked !== asked) continue;
      one.letter = !named.has(one) ? "" : asked ? String(k + 1) : letterOf(k);
      if (named.has(one)) k += 1;
    }
  }
}

/** @param {Placed[]} marks @param {number} room @param {boolean} asked @returns {Cluster[]} */
function gathered(marks, room, asked) {
  const found = /** @type {Cluster[]} */ ([]);
  for (const mark of marks) {
    const before = found.at(-1);
    const grave = mark.kind === "alarm";
    if (before && mark.x - before.x < room) {
      before.marks.push(mark);
      before.grave ||= grave;
      before.rank = Math.min(before.rank, mark.rank);
    } else {
      const { x, rank } = mark;
      found.push({ x, letter: "", marks: [mark], texts: [], grave, rank, asked });
    }
  }
  return found;
}

/**
 * Texts of neighbours, the weightiest first, of those the latest; what came often stands there once.
 * @param {Placed[]} marks
 * @param {boolean} time
 */
function textsOf(marks, time) {
  const counts = new Map();
  const sorted = [...marks].sort((a, b) => a.rank - b.rank || (time ? b.x - a.x : 0));
  for (const { text } of sorted) counts.set(text, (counts.get(text) ?? 0) + 1);
  return [...counts].map(([text, count]) => (count > 1 ? `${text} (${count}×)` : text));
}

/** @param {number} k */
function letterOf(k) {
  const last = String.fromCharCode(65 + (k % 26));
  return k < 26 ? last : letterOf(Math.floor(k / 26) - 1) + last;
}

/** @param {Cluster} mark @param {Record<string, string>} paint */
function markShape(mark, paint) {
  const line = mark.grave
    ? { color: paint.text, width: 2, dash: "solid" }
    : { color: paint.muted, width: 1, dash: "2px,3px" };
  return { type: "line", x0: mark.x, x1: mark.x, yref: "paper", y0: 0, y1: 1, line };
}

/** @param {Cluster} mark @param {Record<string, string>} paint */
function markLetter(mark, paint) {
  const yanchor = mark.asked ? "top" : "bottom";
  const top = { yref: "paper", y: 1, yanchor, xanchor: "center", showarrow: false };
  const box = { bordercolor: mark.grave ? paint.text : paint.muted, borderwidth: 1, borderpad: 1 };
  return { x: mark.x, text: mark.letter, ...top, ...box, font: { color: paint.text, size: 11 } };
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
 * @returns {import("./chart_legend.js").Entry[]}
 */
function entriesOf(drawn, axis, marks, paint) {
  const entries = /** @type {import("./chart_legend.js").Entry[]} */ ([]);
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
    const text = more > 0 && most > 1 ? word("chart.and_more", { text: some, count: more }) : some;
    const value = more > 0 && most === 1 ? `+${more}` : "";
    if (letter) entries.push({ kind: "mark", letter, text, value, grave });
  }
  const left = marks.filter((mark) => !mark.letter).flatMap((mark) => mark.marks).length;
  const others = drawn.chart.still ? `+${left}` : word("chart.and_others", { count: left });
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
  const button = (/** @type {string} */ sign, /** @type {string} */ name, move) => {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = sign;
    made.setAttribute("aria-label", name);
    made.title = name;
    made.addEventListener("click", () => {
      const now = axisOf(drawn);
      move(now, now.last - now.first);
    });
    tools.append(made);
  };
  button("◀", word("chart.earlier"), ({ first, last }, span) =>
    show(drawn, [first - span / 2, last - span / 2]),
  );
  button("▶", word("chart.later"), ({ first, last }, span) =>
    show(drawn, [first + span / 2, last + span / 2]),
  );
  button("−", word("chart.zoom_out"), ({ first, last }, span) =>
    show(drawn, [first - span / 2, last + span / 2]),
  );
  button("+", word("chart.zoom_in"), ({ first, last }, span) =>
    show(drawn, [first + span / 4, last - span / 4]),
  );
  button(word("chart.all"), word("chart.show_all"), () => show(drawn, null));
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
