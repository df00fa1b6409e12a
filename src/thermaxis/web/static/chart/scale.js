// @ts-check
// Scales and paths of a chart: round ticks, and lines of no more points than there are pixels.

/** @typedef {(number | null)[]} Values */
/** @typedef {(value: number) => number} Scale to pixels */
/** @typedef {{at: number, low: number, high: number}} Column */

/** @param {unknown} y @returns {y is number} */
export const isNumber = (y) => typeof y === "number" && Number.isFinite(y);

/** Return round values within a range, and the decimals that tell them apart.
 * @param {number} low @param {number} high @param {number} most steps that have room
 * @param {number} [smallest] step */
export function numberTicks(low, high, most, smallest = 0) {
  const least = Math.max(smallest, (high - low) / Math.max(3, Math.floor(most)));
  const power = 10 ** Math.floor(Math.log10(least));
  const step = power * ([1, 2, 5].find((n) => n * power >= least) ?? 10);
  const from = Math.ceil(low / step - 1e-9);
  const length = Math.floor(high / step + 1e-9) - from + 1;
  const at = Array.from({ length }, (_, k) => (from + k) * step);
  return { at, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

/** Return what an axis shows, all values and a margin; null where there is no value.
 * @param {Values} values @param {number} [least] span that it has at least
 * @returns {[number, number] | null} */
export function rangeOf(values, least = 0) {
  const there = values.filter(isNumber);
  const low = there.reduce((a, b) => Math.min(a, b), Infinity);
  const high = there.reduce((a, b) => Math.max(a, b), -Infinity);
  const margin = Math.max(0.05 * (high - low), (least - (high - low)) / 2) || 1;
  return there.length ? [low - margin, high + margin] : null;
}

/** Return stretches without a gap: the lowest and highest value of each column of half a pixel.
 * @param {number[]} x rising @param {Values} low @param {Values} high @param {Scale} toX */
function stretchesOf(x, low, high, toX) {
  const found = /** @type {Column[][]} */ ([[]]);
  x.forEach((value, k) => {
    const [at, down, up] = [Math.round(2 * toX(value)) / 2, low[k], high[k]];
    const stretch = found.at(-1) ?? [];
    const same = stretch.at(-1);
    if (!isNumber(down) || !isNumber(up)) {
      if (same) found.push([]);
    } else if (same?.at === at) {
      [same.low, same.high] = [Math.min(same.low, down), Math.max(same.high, up)];
    } else stretch.push({ at, low: down, high: up });
  });
  return found.filter((stretch) => stretch.length);
}

/** Return the path of a line; null is a gap, and what stands between two gaps is a point.
 * @param {number[]} x @param {Values} y @param {Scale} toX @param {Scale} toY */
export function linePath(x, y, toX, toY) {
  return stretchesOf(x, y, y, toX).map((stretch) => {
    const points = stretch.flatMap(({ at, low, high }) =>
      (low === high ? [low] : [low, high]).map((one) => `${at} ${toY(one).toFixed(1)}`));
    return `M${points.join("L")}${points.length > 1 ? "" : "h0"}`;
  }).join("");
}

/** Return the outline of what lies between two lines.
 * @param {number[]} x @param {Values} low @param {Values} high @param {Scale} toX
 * @param {Scale} toY */
export function areaPath(x, low, high, toX, toY) {
  return stretchesOf(x, low, high, toX).map((stretch) => {
    const above = stretch.map((one) => `${one.at} ${toY(one.high).toFixed(1)}`);
    const below = stretch.map((one) => `${one.at} ${toY(one.low).toFixed(1)}`);
    return `M${[...above, ...below.reverse()].join("L")}Z`;
  }).join("");
}
