// @ts-check
// Charts of all pages. Lines differ by dash and marker, not by colour alone; null is a gap; UTC
// comes in and local time is written; who points at a place, or goes there by arrow keys, is told
// the values in the legend, which stands beside the data.

import { drawingOf } from "./draw.js";
import { lineRow, markRows, marksOf, row, sample, svg } from "./legend.js";
import { isNumber } from "./scale.js";
import { milliseconds } from "./time.js";
import { button, made, style } from "../elements.js";
import { moment, number, word } from "../words.js";

/**
 * @typedef {import("./draw.js").Axis} Axis
 * @typedef {import("./scale.js").Values} Values
 * @typedef {string | number} X ISO time, milliseconds since 1970 with `time`, or a number
 *
 * x is rising; dash is solid, dash, dot, dashdot, longdash or longdashdot, marker circle, square,
 * diamond, triangle-up, cross, x or none, at most so many markers (12), color 1 to 6: else by its
 * place. low and high are the edges of a band around it; the legend leaves out what is unlisted.
 * @typedef {{name: string, x: X[], y: Values, low?: Values, high?: Values, unit?: string,
 *   axis?: "left" | "right", dash?: string, marker?: string, markers?: number, color?: number,
 *   digits?: number, unlisted?: boolean}} Line
 *
 * An `alarm` stands out, a `request` stands in a row of its own, with numbers; marksListed of them
 * have a letter, those of the smallest rank (1). A band with one edge is a limit.
 * @typedef {{x: X, text: string, kind?: string, rank?: number}} Mark
 *
 * A still chart is only looked at; whole numbers of x count something. The x axis goes from first
 * to last, the left one over leastSpan at least; label is for who cannot see it. onSpan is told
 * what a person zooms to, null for all.
 * @typedef {{lines: Line[], marks?: Mark[], bands?: {low?: number, high?: number, text?: string}[],
 *   xTitle?: string, yTitle?: string, rightTitle?: string, still?: boolean, time?: boolean,
 *   whole?: boolean, first?: X, last?: X, leastSpan?: number, marksListed?: number, label?: string,
 *   onSpan?: (span: {first: number, last: number} | null) => void}} Chart
 */

const [MOST, MOST_STILL] = [26, 8]; // marks that have a letter
const LEAST_DRAG_PX = 8;
const EVENTS = ["down", "move", "up", "leave", "cancel"].map((one) => `pointer${one}`);
/** Sign, name, and where the span is then that is shown, as parts of it; 0 and 0: all.
 * @type {[string, string, number, number][]} */
const TOOLS = [
  ["◀", word("chart-earlier"), -0.5, 0.5], ["▶", word("chart-later"), 0.5, 1.5],
  ["−", word("chart-zoom_out"), -0.5, 1.5], ["+", word("chart-zoom_in"), 0.25, 0.75],
  [word("chart-all"), word("chart-show_all"), 0, 0],
];
const DRAWN = /** @type {WeakMap<HTMLElement, Drawn>} */ (new WeakMap());

/** Draw a chart, or anew. @param {HTMLElement} element of a stated height @param {Chart} chart */
export function drawChart(element, chart) {
  const drawn = DRAWN.get(element) ?? new Drawn(element);
  DRAWN.set(element, drawn);
  const { first, last } = drawn.chart;
  if (String([first, last]) !== String([chart.first, chart.last])) drawn.view = null;
  drawn.chart = chart;
  drawn.draw();
}

class Drawn {
  chart = /** @type {Chart} */ ({ lines: [] });
  view = /** @type {[number, number] | null} */ (null); // what a person has zoomed to
  at = /** @type {number | null} */ (null); // what is pointed at
  from = /** @type {number | null} */ (null); // where a drag began [px]
  axis = axisOf(this.chart, null);
  marks = marksOf(this.chart, this.axis, 0, 0);
  frame = { begin: 0, end: 1, top: 0, bottom: 1 };
  plot = made("div", "", "chart-plot");
  tools = made("div", "", "chart-tools");
  legend = made("ul", "", "chart-legend");
  cursor = svg("g", { class: "chart-cursor" });

  /** @param {HTMLElement} element */
  constructor(element) {
    style("chart/chart.css");
    element.classList.add("chart");
    element.replaceChildren(this.tools, this.plot, this.legend);
    for (const [sign, name, from, to] of TOOLS) {
      this.tools.append(button(sign, () => {
        const { first, last } = this.axis;
        this.show(from < to ? [first + from * (last - first), first + to * (last - first)] : null);
      }, name));
    }
    for (const name of ["keydown", ...EVENTS]) this.plot.addEventListener(name, this);
    new ResizeObserver(() => this.draw()).observe(this.plot);
  }

  draw() {
    const { chart, legend, plot } = this;
    this.axis = axisOf(chart, this.view);
    this.tools.hidden = Boolean(chart.still);
    let most = chart.marksListed ?? (chart.still ? MOST_STILL : MOST);
    do {
      this.marks = marksOf(chart, this.axis, plot.clientWidth, most);
      this.tell();
    } while (chart.still && overflows(legend) && most-- > 0);
    const { clientWidth: width, clientHeight: height } = plot;
    if (width < 40 || height < 40) return;
    const { drawing, frame } = drawingOf(chart, this.axis, this.marks, width, height);
    this.frame = frame;
    drawing.append(this.cursor);
    plot.replaceChildren(drawing);
    this.tell();
  }

  /** Write the legend with the values at the place that is pointed at, and mark that place. */
  tell() {
    const { at, axis, chart: { lines, bands = [], still, label = "" }, plot } = this;
    const { begin, end, top, bottom } = this.frame;
    const place = (/** @type {number} */ x) => (axis.time ? moment(x) : number(x, 2));
    const shown = at ?? axis.end;
    const values = lines.map((line, k) => number(valueAt(axis, line, k, shown), line.digits ?? 1));
    const listed = lines.map((line, k) => ({ line, k })).filter(({ line }) => !line.unlisted);
    const said = [axis.empty ? word("chart-nothing") : place(shown),
      ...listed.map(({ line, k }) => `${line.name} ${values[k]} ${line.unit ?? ""}`)];
    this.legend.replaceChildren(
      ...listed.map(({ line, k }) => lineRow(line, k, at === null ? "" : values[k])),
      ...bands.filter(({ text }) => text).map(({ text = "", low, high }) => {
        const [kind, dash] = isNumber(low) && isNumber(high) ? ["band", ""] : ["limit", "2 5"];
        return row(kind, sample(`chart-of-${kind}`, dash, ""), text);
      }),
      ...markRows(this.marks));
    for (const [name, value] of Object.entries(still
      ? { role: "img", "aria-label": [label, ...said].join(", ") }
      : { role: "slider", "aria-label": label, "aria-valuetext": said.join(", "), tabindex: 0,
        "aria-valuemin": axis.first, "aria-valuemax": axis.last, "aria-valuenow": shown }
    )) plot.setAttribute(name, String(value));
    this.cursor.replaceChildren();
    if (at === null) return;
    const x = begin + (at - axis.first) / (axis.last - axis.first) * (end - begin);
    const [side, anchor] = x > (begin + end) / 2 ? [-5, "end"] : [5, "start"];
    this.cursor.append(svg("path", { d: `M${x} ${top}V${bottom}` }),
      svg("text", { x: x + side, y: bottom - 5, "text-anchor": anchor }, place(at)));
  }

  /** @param {number | null} at */
  point(at) {
    this.at = at;
    this.tell();
  }

  /** @param {[number, number] | null} view */
  show(view) {
    if (view && !(view[1] - view[0] > 1e-6)) return;
    [this.view, this.at] = [view, null];
    this.draw();
    this.chart.onSpan?.(view && { first: view[0], last: view[1] });
  }

  /** Point at values by mouse, finger or keys; a drag shows what it goes over. */
  handleEvent(/** @type {any} */ event) {
    if (this.chart.still || event.button > 0) return;
    if (event.type === "keydown") this.onKey(event);
    else this.onPointer(event);
  }

  /** @param {PointerEvent} event */
  onPointer({ type, clientX, pointerId, pointerType }) {
    const { axis: { first, last }, frame: { begin, end, top, bottom }, plot } = this;
    const px = Math.min(end, Math.max(begin, clientX - plot.getBoundingClientRect().left));
    const [from, to] = [Math.min(this.from ?? px, px), Math.max(this.from ?? px, px)];
    const xAt = (/** @type {number} */ at) => first + (at - begin) / (end - begin) * (last - first);
    if (type === "pointerdown") plot.setPointerCapture(pointerId);
    if (type !== "pointermove") this.from = type === "pointerdown" ? px : null;
    if (type === "pointerleave" || type === "pointercancel") {
      if (pointerType === "mouse") this.point(null);
      return;
    }
    this.point(xAt(px));
    this.cursor.append(svg("rect", { x: from, y: top, width: to - from, height: bottom - top }));
    if (type === "pointerup" && to - from >= LEAST_DRAG_PX) this.show([xAt(from), xAt(to)]);
  }

  /** @param {KeyboardEvent} event */
  onKey(event) {
    const { first, last } = this.axis;
    const parts = { ArrowLeft: -0.01, ArrowRight: 0.01, Home: -1, End: 1 };
    const part = /** @type {Record<string, number>} */ (parts)[event.key];
    if (part === undefined) return;
    event.preventDefault();
    this.point(Math.min(last, Math.max(first, (this.at ?? last) + part * (last - first))));
  }
}

/** @param {Chart} chart @param {[number, number] | null} view @returns {Axis} */
function axisOf(chart, view) {
  const lines = chart.lines.map((line) => line.x.map(milliseconds));
  const ends = lines.flatMap((x) => [x[0], x.at(-1)]).filter(isNumber);
  let first = chart.first === undefined ? Math.min(...ends) : milliseconds(chart.first);
  let last = chart.last === undefined ? Math.max(...ends) : milliseconds(chart.last);
  const unknown = !view && !Number.isFinite(last - first);
  if (unknown || last <= first) [first, last] = unknown ? [0, 1] : [first - 1, first + 1];
  [first, last] = view ?? [first, last];
  const end = Math.min(last, Math.max(first, ...ends)); // of what is drawn
  const empty = !chart.lines.some((line) => line.y.some(isNumber));
  return { time: Boolean(chart.time), first, last, end, unknown, empty, lines };
}

/** The value of a line at the place of it that is nearest; beyond its ends there is none.
 * @param {Axis} axis @param {Line} line @param {number} k its place @param {number} at */
function valueAt({ lines, first, last }, { y }, k, at) {
  const [x, margin] = [lines[k] ?? [], 0.01 * (last - first)];
  if (!(at >= x[0] - margin && at <= (x.at(-1) ?? NaN) + margin)) return null;
  const after = x.findIndex((one) => one >= at);
  const before = (after < 0 ? x.length : after) - 1;
  return y[after < 0 || at - x[before] < x[after] - at ? before : after];
}

/** Whether a row stands out of the legend, or in a column that is out of sight.
 * @param {HTMLElement} list */
function overflows(list) {
  const { right, bottom } = list.getBoundingClientRect();
  return [...list.children].map((one) => one.getBoundingClientRect())
    .some((box) => box.left > right - 8 || box.bottom > bottom + 1);
}
