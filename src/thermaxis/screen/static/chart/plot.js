// @ts-check
// A chart as Plotly takes it: traces, axes, bands, and the colours of the page.

import { DASHES, MARKERS } from "./legend.js";
import { markLetter, markShape } from "./marks.js";
import { timeTicks, zoneName } from "./time.js";
import { pageLocale, word } from "../words.js";

/**
 * @typedef {import("./chart.js").Axis} Axis
 * @typedef {import("./chart.js").Chart} Chart
 * @typedef {import("./chart.js").Drawn} Drawn
 * @typedef {import("./chart.js").Line} Line
 * @typedef {import("./marks.js").Cluster} Cluster
 */

const TICK_ROOM_PX = 84;
const MOST_MARKERS = 12;
const BLANK = { range: [0, 1], showticklabels: false };

/** @param {Element} near @returns {Record<string, string>} */
export function colours(near) {
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
export function lookOf(line, k) {
  return {
    color: `line-${line.color ?? (k % 6) + 1}`,
    dash: line.dash ?? DASHES[k % DASHES.length] ?? "solid",
    marker: line.marker ?? MARKERS[k % MARKERS.length] ?? "circle",
  };
}

/** @param {Chart} chart @param {Axis} axis @param {Record<string, string>} paint */
export function tracesOf(chart, axis, paint) {
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
export function layoutOf({ chart }, axis, marks, paint, [width, height]) {
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
  return word("chart-local_time", { zone: begun === ended ? begun : `${begun}, ${ended}` });
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
  return { ...middle, text: plain(word("chart-nothing")), font: { color: paint.muted } };
}

/** @param {Axis} axis @param {number} width */
function ticksOf(axis, width) {
  if (axis.unknown) return { tickmode: "array", tickvals: [], ticktext: [] };
  if (!axis.time) return { tickmode: "auto", nticks: Math.max(3, Math.floor(width / 64)) };
  const most = Math.floor((width - 90) / TICK_ROOM_PX);
  const { at, texts } = timeTicks(axis.first, axis.last, most, pageLocale);
  return { tickmode: "array", tickvals: at, ticktext: texts };
}
