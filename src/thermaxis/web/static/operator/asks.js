// @ts-check
// What a person may ask here: which buttons are offered and why not, and what each will do.

import { ask, openDialog } from "../ask/ask.js";
import { diameterWord, foundElsewhere, isHeld, isZero, JUMPED, waitsForAPerson } from "../ask/requests.js";
import { button, byId, say } from "../elements.js";
import { latest } from "../live.js";
import { goalUm } from "./axes.js";
import { facts, gainAt, isTouched, isTrimmed, modelAsksUm } from "./parts.js";
import { clock, duration, number, shortNames, signed, word } from "../words.js";

/** @typedef {Record<string, any>} Status */

/** What can be asked without data, the safe direction: the loop may be reached all the same. */
const SAFE_WITHOUT_DATA = "Disable";

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

/** Why something cannot be asked for in this state, by its button.
 * @param {Status} status @returns {Record<string, string>} */
export function blocked(status) {
  const fault = status.state === "Fault" ? word("operator-why_fault") : "";
  const held = isHeld(status);
  const trimmed = Object.values(status.outputs).some(isTrimmed);
  const touched = Object.values(status.outputs).filter(isTouched);
  const off = status.enabled ? "" : word("operator-why_disabled");
  return {
    Enable: fault || (status.enabled ? word("operator-why_enabled") : ""),
    Disable: fault ? "" : off,
    Hold: fault || (!held ? off
      : word(keepsNothing(status) ? "operator-why_hold_lost" : "operator-why_held")),
    Resume: held ? "" : word("operator-why_not_held"),
    // To take back is always allowed.
    Trim: trimmed ? "" : fault,
    Touch: touched.some(takesTouch) ? ""
      : word(touched.length ? "operator-why_fault" : "operator-why_no_touches"),
    Acknowledge: waitsForAPerson(status) ? status.acknowledge_said : word("operator-why_calm"),
  };
}

/** @param {Status | null} status null: no data */
export function showAsks(status) {
  const may = ["operator", "engineer"].includes(document.body.dataset.role ?? "");
  const why = !may ? word("operator-why_role") : status ? "" : word("operator-why_only_disable");
  byId("asks-why").hidden = why === "";
  say(byId("asks-why"), why);
  const reasons = status ? blocked(status) : {};
  for (const one of /** @type {NodeListOf<HTMLButtonElement>} */ (
    document.querySelectorAll("[data-ask]"))) {
    const name = one.dataset.ask ?? "";
    const own = reasons[name] ?? "";
    one.disabled = why ? !(may && name === SAFE_WITHOUT_DATA) : own !== "";
    const told = name === "Diameter" && status ? diameterWord(status.diameter_mm) : own;
    if (name !== "Touch") say(one.lastElementChild, why && name !== "Diameter" ? "" : told);
  }
}

export function startAsks() {
  for (const one of document.querySelectorAll("[data-ask]")) {
    const name = one.getAttribute("data-ask") ?? "";
    one.addEventListener("click", () => {
      if (name === "Trim") void trim();
      else if (name === "Diameter") void diameter();
      else if (name === "Touch") void touch();
      else plain(name);
    });
  }
}

// ---- what each will do -----------------------------------------------------------------------

/** Ask for what needs no value. @param {string} name */
function plain(name) {
  void ask(name, [], {
    blocked: (status) => blocked(status)[name] ?? "",
    text: (status) => TEXTS[name]?.(status) ?? [],
    ...(name === SAFE_WITHOUT_DATA && { blind: [word("operator-disable_blind"),
      word("operator-disable_text"), word("operator-disable_unseen")] }),
  });
}

/** What will happen, by the question. @type {Record<string, (status: Status) => string[]>} */
export const TEXTS = {
  Enable: (status) => [word("operator-enable_text"), ...followed(status)],
  Disable: (status) => [...fades(status), word("operator-disable_text")],
  Hold: (status) => keepsNothing(status) ? [word("operator-hold_none")] : [
    ...axesOf(status).map(([name, axis]) => word("operator-hold_axis", {
      axis: shortNames(name), now: signed(nowUm(axis), 1),
    })),
    word("operator-hold_text", { time: duration(facts.hold_operator_s) }),
    ...stands(status, "operator-hold_interlock"),
  ],
  Resume: (status) => [word("operator-resume_text"), ...followed(status)],
  Acknowledge: acknowledged,
};

/** Whether a hold would keep no offset: it fades, or waits at zero. @param {Status} status */
function keepsNothing({ state, outputs }) {
  return state === "Fading" || (state === "Warming"
    && Object.values(outputs).every((axis) => isZero(axis.correction_um)));
}

/** What an open interlock has against what is promised. @param {Status} status
 * @param {string} key sentence */
function stands({ opened_said: opened }, key = "operator-ask_interlock") {
  return opened ? [word(key, { opened })] : [];
}

/** What acts; what was written where that is not known. @param {any} axis @returns {number} */
function nowUm(axis) {
  return axis.acting_known ? axis.acting_um : axis.correction_um;
}

/** Where each correction goes when it follows the model. @param {Status} status */
function followed(status) {
  return [...stands(status), ...axesOf(status).map(([name, axis]) => {
    const [wanted, now] = [goalUm(status, axis), nowUm(axis)];
    const values = { axis: shortNames(name), now: signed(now, 1), rate: rate(axis) };
    return wanted === null ? word("operator-enable_unknown", values) : [
      word("operator-enable_axis", {
        ...values, wanted: signed(wanted, 1), time: takes(axis, wanted - now),
      }),
      ...askedFor(axis),
    ].join(" ");
  })];
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
  const still = axesOf(status).every(([, axis]) => isZero(nowUm(axis)));
  return [...still ? [] : stands(status), ...axesOf(status).map(([name, axis]) => {
    const now = nowUm(axis);
    const values = { axis: shortNames(name), now: signed(now, 1), rate: rate(axis),
      time: takes(axis, now) };
    return isZero(now)
      ? word("operator-disable_zero", values) : word("operator-disable_axis", values);
  })];
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
  const touched = axesOf(status).filter(([, axis]) => axis.offset_void)
    .map(([name]) => word("operator-acknowledge_touches", { axis: shortNames(name) }));
  offsets.push(...touched);
  return names.length === 0 ? offsets
    : [...offsets, word("operator-acknowledge_sensors", { names: names.join(", ") })];
}

// ---- trim ------------------------------------------------------------------------------------

async function trim() {
  const { form, show } = openDialog(word("operator-trim_title"), {
    go: word("operator-continue"), template: "trim",
  });
  const chosen = (/** @type {string} */ name) => String(new FormData(form).get(name));
  const axis = () => latest()?.outputs[chosen("output")];
  const largest = () => Number(axis()?.limits?.largest_trim_um ?? 0);
  const steps = /** @type {HTMLButtonElement[]} */ ([...form.querySelectorAll(".op-steps button")]);
  let value = Number(axis()?.trim_um ?? 0);
  for (const step of steps) {
    step.addEventListener("click", () => {
      value = Math.min(Math.max(value + Number(step.value), -largest()), largest());
    });
  }
  byId("trim-back").addEventListener("click", () => { value = 0; });
  byId("trim-output").addEventListener("input", () => { value = Number(axis()?.trim_um ?? 0); });
  const how = await show(() => {
    const status = latest();
    const backAlone = status?.state === "Fault";
    if (backAlone) value = 0;
    for (const step of steps) step.disabled = backAlone;
    const set = axis();
    say(byId("trim-now"), isTrimmed(set)
      ? word("operator-trim_now_by", { ...trimValues(set), left: duration(set.trim_left_s) })
      : word("operator-trim_now"));
    say(byId("trim-value"), `${signed(value, 1)}\u00a0µm`);
    const [low, high] = [number(-largest(), 1), signed(largest(), 1)];
    say(byId("trim-bound"), word("operator-trim_bound", { low, high }));
    byId("trim-expiry").toggleAttribute("data-idle", value === 0);
    return status !== null && !whyNoTrim(status, chosen("output"), value);
  });
  if (how === "asked") askTrim(chosen("output"), value, Number(chosen("seconds")));
}

/** Why a trim cannot be set, or not taken back; empty where it can. @param {Status} status
 * @param {string} output @param {number} value 0: taken back, which is allowed in every state */
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
    text: (status) => {
      const axis = status.outputs[output] ?? {};
      const until = clock(Date.now() + 1000 * seconds).slice(0, 5);
      const change = signed(value - (axis.trim_um ?? 0), 1);
      const values = { ...trimValues(axis), axis: axisName, after: signed(value, 1), until };
      return [
        value === 0 ? word("operator-trim_back", values)
          : isTrimmed(axis) ? word("operator-trim_replaces", values)
            : word("operator-trim_text", values),
        ...status.state === "Active"
          ? [word("operator-trim_moves", { change, rate: rate(axis) })]
          : value === 0 ? [] : [word("operator-trim_waits")],
        word("operator-sign"),
      ];
    },
  });
}

// ---- touch -----------------------------------------------------------------------------------

/** Whether a touch can be believed. @param {any} axis */
function takesTouch(axis) {
  return isTouched(axis) && !axis.offset_void;
}

/** Why a touch cannot be taken; empty where it can. @param {Status} status
 * @param {string} output */
function whyNoTouch(status, output) {
  const axis = status.outputs[output];
  if (!isTouched(axis)) return word("operator-why_no_output");
  return takesTouch(axis) ? "" : word("operator-why_fault");
}

async function touch() {
  const { dialog, form, on, show } = openDialog(word("operator-touch_title"), {
    go: word("operator-continue"), template: "touch",
  });
  const chosen = (/** @type {string} */ name) => String(new FormData(form).get(name));
  const field = padded(form, "touch-value");
  const datum = button(word("operator-datum"), () => dialog.close("datum"));
  on.before(datum);
  const how = await show(() => {
    const status = latest();
    datum.disabled = status === null;
    return status !== null && field.validity.valid && !whyNoTouch(status, chosen("output"));
  });
  if (how === "datum") void ask("Datum", [], { text: () => [word("operator-datum_text")] });
  if (how === "asked") {
    askTouch(chosen("output"), Number(field.value.replace(",", ".")), Number(chosen("age_s")));
  }
}

/** @param {string} output @param {number} value @param {number} ageS */
function askTouch(output, value, ageS) {
  const of = facts.touched[output];
  const values = { axis: shortNames(output), value: signed(value, 1),
    largest: number(of?.largest_um, 1), rate: number(of?.largest_rate_um_per_s, 2) };
  void ask("Touch", [output, value, ageS], {
    blocked: (status) => whyNoTouch(status, output),
    text: (status) => [
      word(status.outputs[output]?.offset_acts ? "operator-touch_text" : "operator-touch_shown", values),
      word("operator-touch_excluded"), word("operator-sign"),
    ],
  });
}

/** A field of a dialog, into which its keys write. @param {HTMLElement} form @param {string} id */
function padded(form, id) {
  const field = /** @type {HTMLInputElement} */ (byId(id));
  for (const key of /** @type {NodeListOf<HTMLButtonElement>} */ (
    form.querySelectorAll(".op-pad button"))) {
    key.addEventListener("click", () => { field.value = typed(field.value, key.value); });
  }
  return field;
}

/** What stands in a field after a key; without a sign it deletes.
 * @param {string} before @param {string} key */
function typed(before, key) {
  if (key === "±") return before.startsWith("-") ? before.slice(1) : `-${before}`;
  return (key ? before + key : before.slice(0, -1)).slice(0, 9);
}

// ---- diameter --------------------------------------------------------------------------------

async function diameter() {
  const { dialog, form, on, show } = openDialog(word("operator-diameter_title"), {
    go: word("operator-continue"), template: "diameter",
  });
  const field = padded(form, "diameter-value");
  const centre = button(word("operator-diameter_centre"), () => dialog.close("centre"));
  on.before(centre);
  const how = await show(() => {
    const status = latest();
    const now = diameterWord(status?.diameter_mm);
    say(byId("diameter-now"), status ? word("operator-diameter_now", { diameter: now }) : "");
    byId("diameter-range").hidden = status?.model_sha256 !== facts.model_sha256;
    centre.disabled = status === null;
    return status !== null && field.validity.valid;
  });
  if (how === "centre") askDiameter(null);
  if (how === "asked") askDiameter(Number(field.value.replace(",", ".")));
}

/** @param {number | null} value */
function askDiameter(value) {
  const diameter = diameterWord(value);
  void ask(value === null ? "NoDiameter" : "Diameter", value === null ? [] : [value], {
    text: (status) => [
      word("operator-diameter_text", { diameter, before: diameterWord(status.diameter_mm) }),
      ...counts(status, value),
    ],
  });
}

/** Which gain counts for a diameter, for each part that has some.
 * @param {Status} status @param {number | null} mm */
function counts(status, mm) {
  if (status.model_sha256 !== facts.model_sha256) return [word("operator-gain_not_known")];
  const found = Object.entries(facts.gains).flatMap(([output, parts]) =>
    Object.entries(parts).map(([part, gains]) => {
      const [first, last] = [gains.points[0]?.[0] ?? 0, gains.points.at(-1)?.[0] ?? 0];
      const end = mm === null ? null : Math.min(Math.max(mm, first), last);
      const values = { axis: shortNames(output), part: shortNames(part), gain: number(gainAt(gains, mm), 2),
        diameter: diameterWord(mm), end: diameterWord(end) };
      return end === mm ? word("operator-gain_counts", values)
        : word("operator-gain_end_counts", values);
    }));
  return found.length ? [...found, word("operator-diameter_follows")] : [word("operator-gain_none")];
}
