// @ts-check
/** Legend of a chart, beside the data and never over them: sample, name, value, marks in words. */

import { made } from "../elements.js";

const SVG = "http://www.w3.org/2000/svg";

/** Dashes as Plotly names them, and as SVG draws them. */
export const DASHES = ["solid", "dash", "dot", "dashdot", "longdash", "longdashdot"];
const STROKES = /** @type {Record<string, string>} */ ({
  solid: "",
  dash: "7 4",
  dot: "2 3",
  dashdot: "7 3 2 3",
  longdash: "11 4",
  longdashdot: "11 3 2 3",
});

/** Markers as Plotly names them, and as SVG draws them around 0 0. */
export const MARKERS = ["circle", "square", "diamond", "triangle-up", "cross", "x"];
const SHAPES = /** @type {Record<string, string>} */ ({
  circle: "M 4 0 A 4 4 0 1 1 -4 0 A 4 4 0 1 1 4 0 Z",
  square: "M -3.5 -3.5 H 3.5 V 3.5 H -3.5 Z",
  diamond: "M 0 -5 L 5 0 L 0 5 L -5 0 Z",
  "triangle-up": "M 0 -5 L 4.5 3.5 H -4.5 Z",
  cross: "M -1.5 -4.5 H 1.5 V -1.5 H 4.5 V 1.5 H 1.5 V 4.5 H -1.5 V 1.5 H -4.5 V -1.5 H -1.5 Z",
  x: "M -4 -2 L -2 -4 L 0 -2 L 2 -4 L 4 -2 L 2 0 L 4 2 L 2 4 L 0 2 L -2 4 L -4 2 L -2 0 Z",
});

/**
 * @typedef {{kind: "line", color: string, dash: string, marker: string, text: string,
 *   value: string}} LineEntry
 * @typedef {{kind: "band" | "limit", color: string, text: string}} BandEntry
 * @typedef {{kind: "mark", letter: string, text: string, value: string, grave: boolean}} MarkEntry
 * @typedef {{kind: "more", text: string}} MoreEntry
 * @typedef {LineEntry | BandEntry | MarkEntry | MoreEntry} Entry
 */

/**
 * Write the legend anew.
 * @param {HTMLElement} list
 * @param {Entry[]} entries
 */
export function showLegend(list, entries) {
  list.replaceChildren(...entries.map(row));
}

/** @param {Entry} entry */
function row(entry) {
  const sign = entry.kind === "more" ? [] : [entry.kind === "mark" ? letter(entry) : sample(entry)];
  const value = "value" in entry && entry.value ? [made("strong", entry.value)] : [];
  return made("li", "", `chart-entry chart-entry-${entry.kind}`,
    ...sign, made("span", entry.text), ...value);
}

/** @param {MarkEntry} entry */
function letter(entry) {
  return made("b", entry.letter, entry.grave ? "chart-letter chart-letter-grave" : "chart-letter");
}

/** @param {LineEntry | BandEntry} entry */
function sample(entry) {
  const svg = document.createElementNS(SVG, "svg");
  const set = (/** @type {Element} */ element, /** @type {Record<string, string>} */ to) => {
    for (const [name, value] of Object.entries(to)) element.setAttribute(name, value);
    return element;
  };
  set(svg, { width: "40", height: "14", viewBox: "-20 -7 40 14", "aria-hidden": "true" });
  const draw = (/** @type {string} */ d, /** @type {Record<string, string>} */ look) =>
    svg.append(set(document.createElementNS(SVG, "path"), { d, ...look }));
  if (entry.kind === "band") {
    draw("M -20 -6 H 20 V 6 H -20 Z", { fill: entry.color, "fill-opacity": "0.25" });
    return svg;
  }
  const dash = entry.kind === "line" ? STROKES[entry.dash] : "3 3";
  const line = { stroke: entry.color, "stroke-width": "2", fill: "none" };
  draw("M -20 0 H 20", { ...line, "stroke-dasharray": dash ?? "" });
  if (entry.kind === "line" && entry.marker !== "none") {
    draw(SHAPES[entry.marker] ?? SHAPES.circle, { fill: entry.color });
  }
  return svg;
}
