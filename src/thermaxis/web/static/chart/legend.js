// @ts-check
// Looks of lines, and rows of the legend: sample, name, value.

import { made } from "../elements.js";

/** Strokes with round ends: a dash of no length is a dot. @type {Record<string, string>} */
const DASHES = {
  solid: "", dash: "6 5", dot: "0 4", dashdot: "6 4 0 4", longdash: "11 5", longdashdot: "11 5 0 5",
};
/** Paths from their middle. @type {Record<string, string>} */
const MARKERS = {
  circle: "m4 0a4 4 0 1 1-8 0a4 4 0 1 1 8 0z",
  square: "m-3.5-3.5h7v7h-7z",
  diamond: "m0-5l5 5l-5 5l-5-5z",
  "triangle-up": "m0-5l4.5 8.5h-9z",
  cross: "m-1.5-4.5h3v3h3v3h-3v3h-3v-3h-3v-3h3z",
  x: "m-4-2l2-2l2 2l2-2l2 2l-2 2l2 2l-2 2l-2-2l-2 2l-2-2l2-2z",
  none: "",
};

/** @param {import("./chart.js").Line} line @param {number} k its place */
export function lookOf(line, k) {
  return {
    color: `chart-color-${line.color ?? (k % 6) + 1}`,
    dash: DASHES[line.dash ?? ""] ?? Object.values(DASHES)[k % 6] ?? "",
    marker: MARKERS[line.marker ?? ""] ?? Object.values(MARKERS)[k % 6] ?? "",
  };
}

/** @param {string} tag @param {Record<string, any>} attributes @param {(Node | string)[]} inner */
export function svg(tag, attributes, ...inner) {
  const found = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) found.setAttribute(name, String(value));
  found.append(...inner);
  return found;
}

/** @param {string} name of its class @param {string} dash @param {string} marker */
export function sample(name, dash, marker) {
  const box = { width: 40, height: 14, viewBox: "-20 -7 40 14", "aria-hidden": "true" };
  return svg("svg", { ...box, class: name },
    svg("path", { class: "chart-stroke", d: "M-19 0H19", "stroke-dasharray": dash }),
    svg("path", { class: "chart-marker", d: `M0 0${marker}` }));
}

/** @param {string} kind @param {Node | string} sign @param {string} text @param {string} [value] */
export function row(kind, sign, text, value = "") {
  const parts = [sign, made("span", text), value && made("strong", value)].filter(Boolean);
  return made("li", "", `chart-entry chart-entry-${kind}`, ...parts);
}
