// @ts-check
// What a page has seen itself, by the loop's clock: the last while of it, gaps kept as gaps.

/** @typedef {{t: number[], y: (number | null)[]}} Points */

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
