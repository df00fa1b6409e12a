// @ts-check
// What a person may ask here: which buttons are offered and why not, and what each will do.

import { ask, openDialog } from "../ask/ask.js";
import { foundElsewhere, isHeld, isZero, JUMPED } from "../ask/effects.js";
import { button, byId, made, say } from "../elements.js";
import { latest } from "../live.js";
import { diameterWord, facts, gainAt, isTrimmed, modelAsksUm } from "./parts.js";
import {
  clock, duration, number, pageLocale, shortNames, signed, word,
} from "../words.js";

/** @typedef {Record<string, any>} Status */

const STEPS_UM = [-5, -1, 1, 5];
const DEFAULT_S = 3600;
const LARGEST_MM = 100_000;
const KEYS = ["7", "8", "9", "4", "5", "6", "1", "2", "3", "0", ".", "⌫"];

/** @param {Status} status @returns {[string, any][]} */
function axesOf(status) {
  return Object.entries(status.outputs);
}

/** Time that a change takes at the allowed rate. @param {any} axis @param {number} um */
function takes(axis, um) {
  return axis.limits ? duration(Math.abs(um) / axis.limits.largest_rate_um_per_s) : "–";
}

/** @param {any} axis */
function rate(axis) {
  return number(axis.limits?.largest_rate_um_per_s, 2);
}

// ---- what is offered -------------------------------------------------------------------------

/** Why something cannot be asked for in this state, by its button. @param {Status} status */
function blocked(status) {
  const fault = status.state === "Fault";
  const held = isHeld(status);
  const trimmed = Object.values(status.outputs).some(isTrimmed);
  const jumped = Object.values(status.inputs).some((input) => input.quality === JUMPED);
  const off = status.enabled ? "" : word("operator-why_disabled");
  const waits = fault || jumped || foundElsewhere(status).length > 0;
  const acknowledge = waits ? "" : word("operator-why_calm");
  return {
    Enable: fault ? word("operator-why_fault") : status.enabled ? word("operator-why_enabled") : "",
    Disable: off && status.state !== "Fault" ? off : "",
    Hold: fault ? word("operator-why_fault") : held ? word("operator-why_held") : off,
    Resume: held ? "" : word("operator-why_not_held"),
    // To take back is always allowed.
    Trim: fault && !trimmed ? word("operator-why_fault") : "",
    Diameter: "",
    Acknowledge: acknowledge,
  };
}

/**
 * What can be asked without data: to disable alone, the safe direction. What the page does not see
 * cannot speak against it, and the loop may be reached where its status is not.
 */
const SAFE_WITHOUT_DATA = "Disable";

/** @param {Status | null} status null: no data */
export function showAsks(status) {
  const may = ["operator", "engineer"].includes(document.body.dataset.role ?? "");
  const blind = status === null ? word("operator-why_only_disable") : "";
  const why = may ? blind : word("operator-why_role");
  const place = byId("asks-why");
  place.hidden = why === "";
  say(place, why);
  const reasons = status === null ? {} : blocked(status);
  for (const found of document.querySelectorAll("[data-ask]")) {
    const button = /** @type {HTMLButtonElement} */ (found);
    const own = reasons[/** @type {keyof typeof reasons} */ (button.dataset.ask)] ?? "";
    const safe = may && status === null && button.dataset.ask === SAFE_WITHOUT_DATA;
    button.disabled = !safe && (why !== "" || own !== "");
    const said = why === "" ? own : "";
    const diameterMm = status?.diameter_mm;
    say(button.lastElementChild, button.dataset.ask === "Diameter" && status
      ? diameterWord(diameterMm) : said);
  }
}

export function startAsks() {
  for (const button_ of document.querySelectorAll("[data-ask]")) {
    const name = button_.getAttribute("data-ask") ?? "";
    button_.addEventListener("click", () => {
      const status = latest();
      if (name === "Trim" && status) trim(status);
      else if (name === "Diameter" && status) diameter(status);
      else if (status || name === SAFE_WITHOUT_DATA) plain(name);
    });
  }
}

// ---- what each will do -----------------------------------------------------------------------

/** Ask for what needs no value. @param {string} name */
function plain(name) {
  const method = /** @type {keyof typeof TEXTS} */ (name);
  void ask(method, [], {
    blocked: (status) => blocked(status)[method],
    title: word(TITLES[method]),
    text: TEXTS[method],
    ...(method === SAFE_WITHOUT_DATA ? { blind: [word("operator-disable_blind"),
      word("operator-disable_text"), word("operator-disable_unseen")] } : {}),
  });
}

const TITLES = {
  Enable: "operator-enable_title", Disable: "operator-disable_title", Hold: "operator-hold_title",
  Resume: "operator-resume_title", Acknowledge: "operator-acknowledge_title",
};

/** What will happen. @type {Record<keyof typeof TITLES, (status: Status) => string[]>} */
const TEXTS = {
  Enable: (status) => [word("operator-enable_text"), ...followed(status)],
  Disable: (status) => [...fades(status), word("operator-disable_text")],
  Hold: (status) => [
    ...axesOf(status).map(([name, axis]) => word("operator-hold_axis", {
      axis: shortNames(name), now: signed(axis.correction_um, 1),
    })),
    word("operator-hold_text", { time: duration(facts.hold_operator_s) }),
  ],
  Resume: (status) => [word("operator-resume_text"), ...followed(status)],
  Acknowledge: acknowledged,
};

/** Where each correction goes when it follows the model. @param {Status} status */
function followed(status) {
  return axesOf(status).map(([name, axis]) => [
    word("operator-enable_axis", {
      axis: shortNames(name),
      now: signed(axis.correction_um, 1),
      wanted: signed(axis.wanted_um, 1),
      rate: rate(axis),
      time: takes(axis, axis.wanted_um - axis.correction_um),
    }),
    ...askedFor(axis),
  ].join(" "));
}

/** Who asks for what of it: the model, and whoever has trimmed. @param {any} axis */
function askedFor(axis) {
  const model = signed(modelAsksUm(axis), 1);
  const said = axis.at_limit
    ? word("operator-asks_over", { model, largest: number(axis.limits?.largest_um, 1) })
    : word("operator-asks_model", { model });
  return isTrimmed(axis) ? [said, word("operator-asks_trim", trimValues(axis))] : [said];
}

/** @param {any} axis */
function trimValues(axis) {
  return { owner: axis.trim_owner || "–", trim: signed(axis.trim_um, 1) };
}

/** @param {Status} status */
function fades(status) {
  return axesOf(status).map(([name, axis]) => {
    const values = { axis: shortNames(name), now: signed(axis.correction_um, 1),
      rate: rate(axis), time: takes(axis, axis.correction_um) };
    return isZero(axis.correction_um)
      ? word("operator-disable_zero", values) : word("operator-disable_axis", values);
  });
}

/** What an acknowledgement says. @param {Status} status */
function acknowledged(status) {
  if (status.state === "Fault") {
    const reason = status.reasons_said.join(" ");
    return [word("operator-acknowledge_fault", { reason }), ...fades(status),
      word("operator-acknowledge_after")];
  }
  const names = Object.entries(status.inputs)
    .filter(([, input]) => input.quality === JUMPED)
    .map(([name, input]) => `${shortNames(name)} (${number(input.read, 1)}\u00a0°C)`);
  const offsets = foundElsewhere(status)
    .map((alarm) => word("operator-acknowledge_found", { found: alarm.text }));
  if (names.length === 0 && offsets.length > 0) return offsets;
  return [...offsets, word("operator-acknowledge_sensors", { names: names.join(", ") || "–" })];
}

// ---- trim ------------------------------------------------------------------------------------

/** @param {Status} status */
function trim(status) {
  const names = Object.keys(status.outputs);
  let output = names[0] ?? "";
  let value = Number(status.outputs[output]?.trim_um ?? 0);
  let seconds = facts.expiries_s.includes(DEFAULT_S) ? DEFAULT_S : facts.expiries_s[0] ?? DEFAULT_S;
  const { dialog, body, buttons } = openDialog(word("operator-trim_title"));
  const axes = choice(word("operator-trim_axis"), names.map((name) => [name, shortNames(name)]),
    () => output, (name) => {
      output = name;
      value = Number(latest()?.outputs[name]?.trim_um ?? 0);
      draw();
    });
  axes.hidden = names.length < 2;
  const now = made("p", "", "op-quiet");
  const shown = made("output", "", "op-pad-value");
  const bound = made("p", "", "op-quiet");
  const steps = made("div", "", "op-steps");
  for (const step of STEPS_UM) {
    steps.append(button(`${signed(step, 0)}\u00a0µm`, () => { change(value + step); },
      word("operator-trim_step", { step: signed(step, 0) })));
  }
  const zero = button(word("operator-trim_zero"), () => { change(0); });
  const expiry = choice(word("operator-trim_expires"),
    facts.expiries_s.map((s) => [String(s), duration(s)]), () => String(seconds),
    (text) => { seconds = Number(text); draw(); });
  const owner = made("p", word("operator-trim_owner", { name: document.body.dataset.name ?? "" }));
  const go = button(word("operator-continue"), () => { dialog.close("asked"); });
  go.className = "main";
  buttons.append(go);
  body.append(axes, now, shown, bound, steps, zero, expiry, owner);

  const largest = () => Number(latest()?.outputs[output]?.limits?.largest_trim_um ?? 0);
  /** @param {number} to */
  function change(to) {
    value = Math.min(Math.max(to, -largest()), largest());
    draw();
  }
  function draw() {
    const status = latest();
    const axis = status?.outputs[output];
    const backAlone = status?.state === "Fault";
    if (backAlone) value = 0;
    for (const step of steps.querySelectorAll("button")) step.disabled = backAlone;
    say(now, isTrimmed(axis)
      ? word("operator-trim_now_by", { ...trimValues(axis), left: duration(axis.trim_left_s) })
      : word("operator-trim_now"));
    say(shown, `${signed(value, 1)}\u00a0µm`);
    const [low, high] = [number(-largest(), 1), signed(largest(), 1)];
    say(bound, word("operator-trim_bound", { low, high }));
    expiry.toggleAttribute("data-idle", value === 0);
    for (const one of body.querySelectorAll("[data-choice]")) {
      const mine = one.getAttribute("data-choice");
      one.setAttribute("aria-pressed", String(mine === output || mine === String(seconds)));
    }
    go.disabled = status === null || whyNoTrim(status, output, value) !== "";
  }
  whileOpen(dialog, draw);
  dialog.addEventListener("close", () => {
    if (dialog.returnValue === "asked") askTrim(output, value, seconds);
    dialog.remove();
  });
}

/**
 * Why a trim cannot be set, or not taken back; empty where it can.
 * @param {Status} status
 * @param {string} output
 * @param {number} value 0: it is taken back, which is allowed in every state
 */
function whyNoTrim(status, output, value) {
  const axis = status.outputs[output];
  if (!axis) return word("operator-why_no_output");
  if (value === 0) return isTrimmed(axis) ? "" : word("operator-why_no_trim");
  return status.state === "Fault" ? word("operator-why_fault") : "";
}

/** @param {string} output @param {number} value @param {number} seconds */
function askTrim(output, value, seconds) {
  const axisName = shortNames(output);
  void ask("Trim", [output, value, seconds], {
    blocked: (status) => whyNoTrim(status, output, value),
    title: `${word("operator-trim_title")}: ${axisName} ${signed(value, 1)}\u00a0µm`,
    text: (status) => {
      const axis = status.outputs[output];
      const until = clock(Date.now() + 1000 * seconds).slice(0, 5);
      const moves = value - (axis?.trim_um ?? 0);
      const values = { ...trimValues(axis ?? {}), axis: axisName, after: signed(value, 1), until };
      return [
        value === 0 ? word("operator-trim_back", values)
          : isTrimmed(axis) ? word("operator-trim_replaces", values)
            : word("operator-trim_text", values),
        ...status.state === "Active"
          ? [word("operator-trim_moves", { change: signed(moves, 1), rate: rate(axis) })]
          : value === 0 ? [] : [word("operator-trim_waits")],
        word("operator-sign"),
      ];
    },
  });
}

// ---- diameter --------------------------------------------------------------------------------

/** @param {Status} status */
function diameter(status) {
  const { dialog, body, buttons } = openDialog(word("operator-diameter_title"));
  const mark = (1.5).toLocaleString(pageLocale).charAt(1);
  const field = /** @type {HTMLInputElement} */ (made("input", "", "op-pad-value"));
  field.inputMode = "none";
  field.maxLength = 9;
  field.autocomplete = "off";
  field.setAttribute("aria-label", `${word("operator-diameter_title")} [mm]`);
  const box = made("div", "", "op-pad-field");
  box.append(field, made("span", "mm"));
  const pad = made("div", "", "op-pad");
  for (const key of KEYS) {
    const text = key === "." ? mark : key;
    pad.append(button(text, () => {
      field.value = key === "⌫" ? field.value.slice(0, -1) : (field.value + text).slice(0, 9);
      draw();
    }, key === "⌫" ? word("operator-diameter_clear") : text));
  }
  const centre = button(word("operator-diameter_centre"), () => { dialog.close("centre"); });
  const go = button(word("operator-continue"), () => { dialog.close("asked"); });
  go.className = "main";
  buttons.append(centre, go);
  const wrong = made("p", word("operator-diameter_wrong"), "ask-wrong");
  const range = rangeOf(status);
  const side = made("div", "", "op-pad-side");
  side.append(
    made("p", word("operator-diameter_now", { diameter: diameterWord(status.diameter_mm) })),
    box, wrong,
    ...(range ? [made("p", word("operator-diameter_range", range), "op-quiet")] : []),
    ...(facts.diameter_read ? [made("p", word("operator-diameter_machine"), "op-quiet")] : []),
  );
  const both = made("div", "", "op-pad-both");
  both.append(side, pad);
  body.append(both);

  const value = () => diameterOf(field.value);
  function draw() {
    go.disabled = value() === null || latest() === null;
    centre.toggleAttribute("disabled", latest() === null);
    wrong.classList.toggle("unseen", field.value === "" || value() !== null);
  }
  field.addEventListener("input", draw);
  field.addEventListener("keydown", (event) => {
    if (event.key === "Enter" && !go.disabled) dialog.close("asked");
  });
  whileOpen(dialog, draw);
  field.focus();
  dialog.addEventListener("close", () => {
    const found = value();
    if (dialog.returnValue === "centre") askDiameter(null);
    if (dialog.returnValue === "asked" && found !== null) askDiameter(found);
    dialog.remove();
  });
}

/** @param {string} text @returns {number | null} */
function diameterOf(text) {
  if (!/^\d{1,6}([.,]\d{0,3})?$/.test(text)) return null;
  const value = Number(text.replace(",", "."));
  return value <= LARGEST_MM ? value : null;
}

/** Range of the diameters that the model knows. @param {Status} status */
function rangeOf(status) {
  if (status.model_sha256 !== facts.model_sha256) return null;
  const points = Object.values(facts.gains).flatMap((parts) => Object.values(parts))
    .flatMap((gains) => gains.points.map(([mm]) => mm));
  if (!points.length) return null;
  return { low: number(Math.min(...points), 0), high: number(Math.max(...points), 0) };
}

/** @param {number | null} value */
function askDiameter(value) {
  const method = value === null ? "NoDiameter" : "Diameter";
  void ask(method, value === null ? [] : [value], {
    title: word("operator-diameter_is", { diameter: diameterWord(value) }),
    text: (status) => [
      word("operator-diameter_text", {
        diameter: diameterWord(value), before: diameterWord(status.diameter_mm),
      }),
      ...counts(status, value),
    ],
  });
}

/** Which gain counts for a diameter, for each part that has some. @param {Status} status
 * @param {number | null} mm */
function counts(status, mm) {
  if (status.model_sha256 !== facts.model_sha256) return [word("operator-gain_not_known")];
  const found = Object.entries(facts.gains).flatMap(([output, parts]) =>
    Object.entries(parts).map(([part, gains]) => {
      const [first, last] = [gains.points[0]?.[0] ?? 0, gains.points.at(-1)?.[0] ?? 0];
      const end = mm === null ? null : Math.min(Math.max(mm, first), last);
      const values = { axis: shortNames(output), part, gain: number(gainAt(gains, mm), 2),
        diameter: diameterWord(mm), end: diameterWord(end) };
      return end === mm ? word("operator-gain_counts", values)
        : word("operator-gain_end_counts", values);
    }));
  return found.length ? found : [word("operator-gain_none")];
}

// ---- pieces ----------------------------------------------------------------------------------

/**
 * Buttons of which one is pressed.
 * @param {string} title
 * @param {[string, string][]} choices value and text
 * @param {() => string} now
 * @param {(value: string) => void} act
 */
function choice(title, choices, now, act) {
  const group = made("div", "", "op-choice");
  group.setAttribute("role", "group");
  group.setAttribute("aria-label", title);
  group.append(made("p", title));
  for (const [value, text] of choices) {
    const one = button(text, () => { act(value); });
    one.dataset.choice = value;
    one.setAttribute("aria-pressed", String(now() === value));
    group.append(one);
  }
  return group;
}

/** Show a dialog, and draw it anew twice a second. @param {HTMLDialogElement} dialog
 * @param {() => void} draw */
function whileOpen(dialog, draw) {
  draw();
  const timer = setInterval(draw, 500);
  dialog.addEventListener("close", () => { clearInterval(timer); });
  dialog.showModal();
}
