// @ts-check
// Time axis of the charts. It counts milliseconds since 1970, so a change of the clocks neither
// folds a line back nor leaves a hole in it: only the texts at the ticks are local.

const MINUTE = 60_000;
const HOUR = 60 * MINUTE;
/** Steps as milliseconds, days and months of the calendar. @type {[number, number, number][]} */
const STEPS = [
  ...[1000, MINUTE].flatMap((unit) => [1, 2, 5, 10, 15, 30].map((n) => [n * unit, 0, 0])),
  ...[1, 2, 3, 6, 12].map((n) => [n * HOUR, 0, 0]),
  ...[1, 2, 5, 10].map((n) => [0, n, 0]),
  ...[1, 2, 3, 6, 12, 60, 120, 240].map((n) => [0, 0, n]),
];
const DATE = /** @type {const} */ ({ day: "numeric", month: "numeric" });

/** @param {string | number} time ISO 8601 or milliseconds @returns {number} since 1970 [ms] */
export const milliseconds = (time) => (typeof time === "number" ? time : Date.parse(time));

/** Return ticks at round local times; a text has the date in a second line where a day begins.
 * @param {number} first [ms] @param {number} last [ms] @param {number} most that have room
 * @param {string} language of the texts */
export function timeTicks(first, last, most, language) {
  const least = (last - first) / Math.max(2, most);
  const [ms, days, months] = STEPS.find(([some, d, m]) =>
    some + 24 * HOUR * (d + 30 * m) >= least) ?? [0, 0, 600];
  const begin = new Date(first);
  const month = months ? Math.floor(begin.getMonth() / months) * months : begin.getMonth();
  const [year, day] = [begin.getFullYear(), months ? 1 : begin.getDate()];
  // one hour of margin: on two days of the year a day is not 24 hours long
  const passed = first - new Date(year, month, day).getTime() - HOUR;
  const found = /** @type {Set<number>} */ (new Set());
  for (let k = ms ? Math.max(0, Math.floor(passed / ms)) : 0; ; k += 1) {
    const tick = new Date(year, month + k * months, day + k * days, 0, 0, 0, k * ms).getTime();
    if (!(tick <= last)) break;
    if (tick >= first) found.add(tick);
  }
  const at = [...found].sort((a, b) => a - b);
  const second = ms < MINUTE ? "2-digit" : undefined;
  const clock = { hour: "2-digit", minute: "2-digit", second, hourCycle: "h23" };
  const how = ms ? clock : days ? DATE : { month: "short", year: "numeric" };
  const form = new Intl.DateTimeFormat(language, /** @type {Intl.DateTimeFormatOptions} */ (how));
  const date = new Intl.DateTimeFormat(language, DATE);
  return { at, texts: at.map((tick, k) => {
    const same = !ms || (k > 0 && date.format(tick) === date.format(at[k - 1]));
    return form.format(tick) + (same ? "" : `\n${date.format(tick)}`);
  }) };
}

/** Name the zones of local times, such as CET. @param {number[]} times @param {string} language */
export function zoneNames(times, language) {
  const form = new Intl.DateTimeFormat(language, { timeZoneName: "short" });
  const names = times.map((time) =>
    form.formatToParts(time).find((part) => part.type === "timeZoneName")?.value ?? "UTC");
  return [...new Set(names)].join(", ");
}
