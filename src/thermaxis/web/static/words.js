// @ts-check
// Texts of the page, and numbers and times as its language writes them.

/** @type {Record<string, string>} */
const words = JSON.parse(document.getElementById("words")?.textContent ?? "{}");
/** The locale of numbers and times. */
export const pageLocale = document.documentElement.lang;
/** Its language alone. */
export const pageLanguage = pageLocale.slice(0, 2);
const MINUS = "\u2212";
const ABSENT = "\u2013";
const GAP = /\{(\w+)\}/g;

/** @type {Map<number, Intl.NumberFormat>} */
const formats = new Map();

/** @param {number} digits */
function formatOf(digits) {
  const found = formats.get(digits) ?? new Intl.NumberFormat(pageLocale, {
    minimumFractionDigits: digits, maximumFractionDigits: digits, useGrouping: false,
  });
  formats.set(digits, found);
  return found;
}

/**
 * A number rounded as the loop's own texts are: by its exact value, a tie to the even digit.
 * @param {number} value not negative
 * @param {number} digits
 */
function rounded(value, digits) {
  const halves = value * 2 * 10 ** digits;
  const tie = Number.isInteger(value * 2 ** (digits + 1)) && halves % 2 === 1;
  if (!tie) return Number(value.toFixed(digits));
  const low = (halves - 1) / 2;
  return (low % 2 === 0 ? low : low + 1) / 10 ** digits;
}

/**
 * A number with so many decimals; a dash where there is none.
 * @param {number | null | undefined} value
 * @param {number} digits
 */
export function number(value, digits) {
  if (!isNumber(value)) return ABSENT;
  const found = rounded(Math.abs(value), digits);
  return (value < 0 && found > 0 ? MINUS : "") + formatOf(digits).format(found);
}

/**
 * A number with a sign, also where it is positive.
 * @param {number | null | undefined} value
 * @param {number} digits
 */
export function signed(value, digits) {
  const plus = isNumber(value) && value > 0 && rounded(value, digits) > 0;
  return (plus ? "+" : "") + number(value, digits);
}

/** @param {unknown} value @returns {value is number} */
function isNumber(value) {
  return typeof value === "number" && Number.isFinite(value);
}

/**
 * A length as it was stated, with as many decimals as it has, three at most.
 * @param {number | null | undefined} value
 */
export function exactly(value) {
  const digits = [0, 1, 2].find((one) => Number((value ?? 0).toFixed(one)) === value) ?? 3;
  return number(value, digits);
}

/**
 * A text of the page's language.
 * @param {string} key
 * @param {Record<string, unknown>} [values] what stands for {name}
 */
export function word(key, values = {}) {
  return (words[key] ?? key).replace(GAP, (whole, name) =>
    Object.hasOwn(values, name) ? String(values[name] ?? ABSENT) : whole);
}

/** What people call the inputs. @type {Record<string, string>} */
const called = JSON.parse(document.body?.dataset?.names || "{}");

/**
 * Outputs and inputs as they are shown: as people call them, else without the unit, which stands
 * beside the value.
 * @param {string} names one, or several with ", " between
 */
export function shortNames(names) {
  const own = (/** @type {string} */ name) => Object.hasOwn(called, name) && called[name];
  return names.split(", ").map((one) => own(one) || one.replace(/_(um|C)$/, "")).join(", ");
}

const clockFormat = new Intl.DateTimeFormat(pageLocale, {
  hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23",
});
const momentFormat = new Intl.DateTimeFormat(pageLocale, {
  year: "numeric", month: "2-digit", day: "2-digit",
  hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23",
});

/**
 * Time of day, local.
 * @param {string | number | Date | null | undefined} time
 */
export function clock(time) {
  return shown(clockFormat, time);
}

/**
 * Date and time of day, local.
 * @param {string | number | Date | null | undefined} time
 */
export function moment(time) {
  return shown(momentFormat, time);
}

/** The time of day; with the date if it was another day. @param {string | number} time */
export function timeOf(time) {
  const today = new Date(time).toDateString() === new Date().toDateString();
  return today ? clock(time) : moment(time);
}

/**
 * @param {Intl.DateTimeFormat} how
 * @param {string | number | Date | null | undefined} time
 */
function shown(how, time) {
  if (time === null || time === undefined) return ABSENT;
  const date = new Date(time);
  return Number.isNaN(date.getTime()) ? ABSENT : how.format(date);
}

/**
 * A time span in the two largest units that it has.
 * @param {number | null | undefined} seconds
 */
export function duration(seconds) {
  if (!isNumber(seconds)) return ABSENT;
  const whole = Math.max(0, Math.round(seconds));
  if (whole < 60) return `${whole}\u00a0s`;
  if (whole < 3600) return two(Math.floor(whole / 60), "min", whole % 60, "s", whole >= 600);
  if (whole < 86400) {
    return two(Math.floor(whole / 3600), "h", Math.floor((whole % 3600) / 60), "min", false);
  }
  const hours = Math.floor((whole % 86400) / 3600);
  return two(Math.floor(whole / 86400), "d", hours, "h", false);
}

/**
 * @param {number} large
 * @param {string} largeUnit
 * @param {number} small
 * @param {string} smallUnit
 * @param {boolean} rough
 */
function two(large, largeUnit, small, smallUnit, rough) {
  const first = `${large}\u00a0${largeUnit}`;
  return rough || small === 0 ? first : `${first} ${small}\u00a0${smallUnit}`;
}
