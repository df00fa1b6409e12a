// @ts-check
/**
 * Time axis of the charts: UTC comes in, local time is written at the axis.
 *
 * The axis itself counts milliseconds since 1970, so a change of the clocks neither folds a line
 * back nor leaves a hole in it: only the texts at the ticks are local.
 */

const SECOND = 1000;
const MINUTE = 60 * SECOND;
const HOUR = 60 * MINUTE;
const DAY = 24 * HOUR;
const WITHIN_A_DAY = [
  ...[1, 2, 5, 10, 15, 30].map((n) => n * SECOND),
  ...[1, 2, 5, 10, 15, 30].map((n) => n * MINUTE),
  ...[1, 2, 3, 6, 12].map((n) => n * HOUR),
];
const DAYS = [1, 2, 5, 10];
const MONTHS = [1, 2, 3, 6, 12, 60, 120];

/**
 * Return a time as milliseconds since 1970; NaN where it is none.
 * @param {string | number | Date} time ISO 8601, milliseconds or a date
 * @returns {number}
 */
export function milliseconds(time) {
  if (typeof time === "number") return time;
  return time instanceof Date ? time.getTime() : Date.parse(time);
}

/**
 * Return ticks at round local times.
 * @param {number} first begin of the axis [ms]
 * @param {number} last end of the axis [ms]
 * @param {number} most most ticks that have room
 * @param {string} language language of the texts
 * @returns {{at: number[], texts: string[]}}
 */
export function timeTicks(first, last, most, language) {
  const span = last - first;
  const room = Math.max(2, most);
  const short = WITHIN_A_DAY.find((step) => span / step <= room);
  if (short !== undefined) return clockTicks(first, last, short, language);
  const days = DAYS.find((step) => span / DAY / step <= room);
  const date = { day: "numeric", month: "numeric" };
  if (days !== undefined) return dateTicks(first, last, days, 0, date, language);
  const months = MONTHS.find((step) => span / (30 * DAY) / step <= room) ?? 240;
  const month = { month: "short", year: "numeric" };
  return dateTicks(first, last, 0, months, month, language);
}

/** @param {number} first @param {number} last @param {number} step @param {string} language */
function clockTicks(first, last, step, language) {
  const time = new Intl.DateTimeFormat(language, {
    hour: "2-digit",
    minute: "2-digit",
    hourCycle: "h23",
    ...(step < MINUTE ? { second: "2-digit" } : {}),
  });
  const date = new Intl.DateTimeFormat(language, { day: "numeric", month: "numeric" });
  const at = new Set();
  for (const day of datesFrom(first, last, 1, 0)) {
    const [y, m, d] = [day.getFullYear(), day.getMonth(), day.getDate()];
    // one hour of margin on both sides: on two days of the year a day is not 24 hours long
    const begin = Math.max(0, Math.floor((first - day.getTime() - HOUR) / step) * step);
    const end = Math.min(DAY, last - day.getTime() + HOUR + step);
    for (let passed = begin; passed < end; passed += step) {
      const tick = new Date(y, m, d, 0, 0, 0, passed).getTime();
      if (tick >= first && tick <= last) at.add(tick);
    }
  }
  const sorted = [...at].sort((a, b) => a - b);
  let before = "";
  const texts = sorted.map((tick) => {
    const today = date.format(tick);
    const text = today === before ? time.format(tick) : `${time.format(tick)}<br>${today}`;
    before = today;
    return text;
  });
  return { at: sorted, texts };
}

/**
 * @param {number} first
 * @param {number} last
 * @param {number} days
 * @param {number} months
 * @param {object} style
 * @param {string} language
 */
function dateTicks(first, last, days, months, style, language) {
  const format = new Intl.DateTimeFormat(language, style);
  const at = datesFrom(first, last, days, months)
    .map((date) => date.getTime())
    .filter((tick) => tick >= first && tick <= last);
  return { at, texts: at.map((tick) => format.format(tick)) };
}

/**
 * Return local midnights, the first of them not behind the begin.
 * @param {number} first
 * @param {number} last
 * @param {number} days
 * @param {number} months
 */
function datesFrom(first, last, days, months) {
  const begin = new Date(first);
  const month = months ? Math.floor(begin.getMonth() / months) * months : begin.getMonth();
  const day = months ? 1 : begin.getDate();
  const dates = [];
  for (let k = 0; k < 1000; k += 1) {
    const date = new Date(begin.getFullYear(), month + k * months, day + k * days);
    if (date.getTime() > last) break;
    dates.push(date);
  }
  return dates;
}

/**
 * Return the name of the local zone at a time, such as CET or GMT+1.
 * @param {number} time [ms]
 * @param {string} language
 * @returns {string}
 */
export function zoneName(time, language) {
  const parts = new Intl.DateTimeFormat(language, { timeZoneName: "short" }).formatToParts(time);
  return parts.find((part) => part.type === "timeZoneName")?.value ?? "UTC";
}

/**
 * Return a locale for Plotly: it brings no German and no Czech of its own.
 * @param {string} locale whose names and signs are taken, and by which Plotly is asked for it
 */
export function plotlyLocale(locale) {
  /** @param {object} style @param {Date[]} dates */
  const names = (style, dates) =>
    dates.map((date) =>
      new Intl.DateTimeFormat(locale, { ...style, timeZone: "UTC" }).format(date),
    );
  const months = Array.from({ length: 12 }, (_, m) => new Date(Date.UTC(2026, m, 1)));
  const days = Array.from({ length: 7 }, (_, d) => new Date(Date.UTC(2026, 1, 1 + d)));
  const parts = new Intl.NumberFormat(locale).formatToParts(-1234567.5);
  const sign = (/** @type {string} */ type, /** @type {string} */ otherwise) =>
    parts.find((part) => part.type === type)?.value ?? otherwise;
  return {
    moduleType: "locale",
    name: locale,
    dictionary: {},
    format: {
      days: names({ weekday: "long" }, days),
      shortDays: names({ weekday: "short" }, days),
      months: names({ month: "long" }, months),
      shortMonths: names({ month: "short" }, months),
      decimal: sign("decimal", "."),
      thousands: sign("group", ""),
      grouping: [3],
      currency: ["", ""],
      date: "%d.%m.%Y",
      time: "%H:%M:%S",
    },
  };
}
