// @ts-check
// Texts, numbers and times in the language of the page.

const given = JSON.parse(document.getElementById("words")?.textContent ?? "{}");
/** @type {Record<string, string>} */
const words = given.words ?? {};
/** @type {Record<string, Record<string, string>>} */
const phrases = given.phrases ?? {};
const locale = { en: "en-GB", de: "de-DE", cs: "cs-CZ" }[document.documentElement.lang] ?? "en-GB";
const MINUS = "\u2212";
const ABSENT = "\u2013";
const NUMBER_ENDS = /_(um|mm|s|c|k)$/;
const LONGEST_PHRASE = 2000;
const NAMES = ["acts_on", "names", "needed", "output"];
const SECONDS = /\{(\w+_s)\} s\b/g;
const LONG_S = 60;
const LONGEST_S = 1e12;
const PLACE = /\{(\w+)(?::(\+?)\.(\d)([f%]))?\}/g;

/** @type {Map<string, Intl.NumberFormat>} */
const formats = new Map();

/**
 * @param {number} digits
 * @returns {Intl.NumberFormat}
 */
function format(digits) {
  const key = String(digits);
  let found = formats.get(key);
  if (!found) {
    found = new Intl.NumberFormat(locale, {
      minimumFractionDigits: digits, maximumFractionDigits: digits, useGrouping: false,
    });
    formats.set(key, found);
  }
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
  if (value === null || value === undefined || !Number.isFinite(value)) return ABSENT;
  const text = format(digits).format(rounded(Math.abs(value), digits));
  return value < 0 && /[1-9]/.test(text) ? MINUS + text : text;
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
 * A number with a sign, also where it is positive.
 * @param {number | null | undefined} value
 * @param {number} digits
 */
export function signed(value, digits) {
  const text = number(value, digits);
  return typeof value === "number" && value > 0 && /[1-9]/.test(text) ? "+" + text : text;
}

/**
 * Fill a text: {name}, or {name:+.1f}, {name:.0f}, {name:.0%} for numbers.
 * @param {string} text
 * @param {Record<string, unknown>} values
 */
export function fill(text, values) {
  return text.replace(PLACE, (whole, name, plus, digits, kind) => {
    if (!Object.hasOwn(values, name)) return whole;
    const value = values[name];
    if (typeof value !== "number") return String(value ?? ABSENT);
    if (kind === undefined) return Number.isInteger(value) ? String(value) : shortest(value);
    if (kind === "%") return number(100 * value, Number(digits)) + "\u00a0%";
    return plus ? signed(value, Number(digits)) : number(value, Number(digits));
  });
}

/** @param {number} value */
function shortest(value) {
  const text = new Intl.NumberFormat(locale, { maximumSignificantDigits: 6, useGrouping: false })
    .format(Math.abs(value));
  return value < 0 ? MINUS + text : text;
}

/**
 * A text of the page's language.
 * @param {string} key
 * @param {Record<string, unknown>} [values]
 */
export function word(key, values = {}) {
  return fill(words[key] ?? key, values);
}

/**
 * What the loop says in English, in the page's language; English where no translation is known.
 * @param {string} group
 * @param {string} english
 */
export function phrase(group, english) {
  const known = phrases[group] ?? {};
  if (Object.hasOwn(known, english)) return known[english];
  if ([...english].length > LONGEST_PHRASE) return english;
  for (const [pattern, translated] of Object.entries(known)) {
    const values = matched(pattern, english);
    if (values) return fill(...inTimes(translated, translatedValues(values), values));
  }
  return english;
}

/**
 * What stands in the places of a pattern, or null where the text is another one.
 * @param {string} pattern
 * @param {string} text
 * @returns {Record<string, string> | null}
 */
function matched(pattern, text) {
  if (!pattern.includes("{")) return null;
  const literals = pattern.split(/\{\w+\}/);
  const names = [...pattern.matchAll(/\{(\w+)\}/g)].map((found) => found[1]);
  if (!text.startsWith(literals[0])) return null;
  /** @type {Record<string, string>} */
  const values = {};
  let at = literals[0].length;
  for (let i = 0; i < names.length - 1; i += 1) {
    const end = text.indexOf(literals[i + 1], at + 1);
    if (end < 0) return null;
    values[names[i]] = text.slice(at, end);
    at = end + literals[i + 1].length;
  }
  const last = literals[names.length];
  const end = text.length - last.length;
  if (end <= at || !text.endsWith(last)) return null;
  values[names[names.length - 1]] = text.slice(at, end);
  return values;
}

/**
 * A text and its values with times of a minute and more in larger units.
 * @param {string} text
 * @param {Record<string, unknown>} values
 * @param {Record<string, string>} english
 * @returns {[string, Record<string, unknown>]}
 */
function inTimes(text, values, english) {
  const filling = { ...values };
  const said = text.replace(SECONDS, (whole, name) => {
    const seconds = /\S/.test(english[name] ?? "") ? Number(english[name]) : NaN;
    if (!(seconds >= LONG_S && seconds < LONGEST_S)) return whole;
    filling[name] = duration(seconds);
    return `{${name}}`;
  });
  return [said, filling];
}

/**
 * Outputs and inputs as they are shown: the unit stands beside the value.
 * @param {string} names one, or several with ", " between
 */
export function shortNames(names) {
  return names.split(", ").map((name) => name.replace(/_(um|C)$/, "")).join(", ");
}

/**
 * A text as a sentence. One that begins with the name of a file or of a value keeps its first
 * letter: with another one it would be another name.
 * @param {string} text
 */
export function asSentence(text) {
  const end = /[.!?]$/.test(text) || text === "" ? "" : ".";
  return large(text) + end;
}

/** A text with a large first letter, unless it begins with a name. @param {string} text */
export function large(text) {
  const [first] = text.split(/[\s:;,]/, 1);
  return /[._/\\]\S|\d/.test(first) ? text : text.charAt(0).toUpperCase() + text.slice(1);
}

/** @param {Record<string, unknown>} values */
function translatedValues(values) {
  return Object.fromEntries(
    Object.entries(values).map(([name, value]) => [name, translatedValue(name, value)]),
  );
}

/**
 * What stands in a gap: a phrase of its own group, a number, or as it is.
 * @param {string} name
 * @param {unknown} value
 */
function translatedValue(name, value) {
  if (typeof value !== "string") return value;
  if (NAMES.includes(name)) return shortNames(value);
  if (Object.hasOwn(phrases, name)) return phrase(name, value);
  const several = name.slice(0, -1);
  if (Object.hasOwn(phrases, several)) {
    return value.split("; ").map((one) => phrase(several, one)).join("; ");
  }
  if (!NUMBER_ENDS.test(name)) return value;
  const text = value.replaceAll("-", MINUS);
  return locale === "en-GB" ? text : text.replaceAll(".", ",");
}

/**
 * An alarm in the page's language; the loop's English where this screen does not know it.
 * @param {{code?: string, values?: Record<string, unknown>,
 *   text: string, cause: string, remedy: string}} alarm
 * @returns {{text: string, cause: string, remedy: string}}
 */
export function alarmWords(alarm) {
  const keys = ["text", "cause", "remedy"].map((part) => `alarms.${alarm.code}.${part}`);
  if (!alarm.values || !keys.every((key) => Object.hasOwn(words, key))) return alarm;
  const values = translatedValues(alarm.values);
  if (typeof values.name === "string") values.name = shortNames(values.name);
  const gaps = keys.flatMap((key) => [...words[key].matchAll(PLACE)].map((found) => found[1]));
  if (!gaps.every((name) => Object.hasOwn(values, name))) return alarm;
  const [text, cause, remedy] = keys.map((key) => fill(words[key], values));
  return { text, cause, remedy };
}

const clockFormat = new Intl.DateTimeFormat(locale, {
  hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23",
});
const momentFormat = new Intl.DateTimeFormat(locale, {
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
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return ABSENT;
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

/** The locale of numbers and times. */
export const pageLocale = locale;
