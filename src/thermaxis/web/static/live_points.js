// @ts-check
// What a page has seen itself, by the loop's clock: the last while of it, gaps kept as gaps.

/** @typedef {{t: number[], y: (number | null)[]}} Points */

/**
 * Add a value. A clock of the loop that was set back takes away what is later by it: the newest
 * is what it says now. A value of the same time is the same cycle told again.
 * @param {Points} points
 * @param {number} at
 * @param {number | null} value
 * @param {number} spanMs what is older goes
 */
export function addPoint(points, at, value, spanMs) {
  if (!Number.isFinite(at) || at === points.t.at(-1)) return;
  let kept = points.t.length;
  while (kept && (points.t[kept - 1] ?? 0) >= at) kept -= 1;
  points.t.splice(kept);
  points.y.splice(kept);
  points.t.push(at);
  points.y.push(value);
  let old = 0;
  while ((points.t[old] ?? at) < at - spanMs) old += 1;
  points.t.splice(0, old);
  points.y.splice(0, old);
}

/**
 * Return a line with a gap wherever nothing came for a while.
 * @param {Points} points
 * @param {number} gapMs longest time between two values that belong together
 * @returns {{x: number[], y: (number | null)[]}}
 */
export function withGaps({ t, y }, gapMs) {
  const found = /** @type {{x: number[], y: (number | null)[]}} */ ({ x: [], y: [] });
  t.forEach((at, k) => {
    const before = t[k - 1] ?? at;
    if (at - before > gapMs) {
      found.x.push(before + 1);
      found.y.push(null);
    }
    found.x.push(at);
    found.y.push(y[k] ?? null);
  });
  return found;
}

/**
 * Return what is stored with what the page has seen since behind it.
 * @param {Points} stored nothing of it is later than the loop's time
 * @param {Points} seen
 * @param {number} nowMs the loop's time
 * @param {number} gapMs longest time between two values that the page has seen
 * @returns {{x: number[], y: (number | null)[]}}
 */
export function joined(stored, seen, nowMs, gapMs) {
  let kept = stored.t.length;
  while (kept && (stored.t[kept - 1] ?? 0) > nowMs) kept -= 1;
  const [x, y] = [stored.t.slice(0, kept), stored.y.slice(0, kept)];
  const last = x.at(-1) ?? -Infinity;
  const first = seen.t.findIndex((at) => at > last);
  if (first < 0) return { x, y };
  const after = withGaps({ t: seen.t.slice(first), y: seen.y.slice(first) }, gapMs);
  const step = last - (x.at(-2) ?? last);
  if (x.length && (after.x[0] ?? last) - last > Math.max(gapMs, 3 * step)) {
    x.push(last + 1);
    y.push(null);
  }
  return { x: [...x, ...after.x], y: [...y, ...after.y] };
}
