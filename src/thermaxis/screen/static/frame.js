// @ts-check
// What every page has: state, alarms, NO DATA, time of day, language, theme, log-out.

import { endKeeping } from "./ask/kept.js";
import { made, say as show } from "./elements.js";
import { noDataWords, onLive, onNoData, onStatus, startLive } from "./live.js";
import { clock, word } from "./words.js";

/** @param {string} id */
function byId(id) {
  return document.getElementById(id);
}

/**
 * Ask the screen's server for something.
 * @param {string} path
 * @param {unknown} body
 */
export async function post(path, body) {
  return fetch(path, {
    method: "POST",
    headers: {
      "Content-Type": "application/json",
      "X-Thermaxis-Token": document.body.dataset.token ?? "",
    },
    body: JSON.stringify(body),
  });
}

const SHAPES = { critical: "1", high: "2", medium: "3", low: "4" };

/**
 * Shape and number of an alarm's priority.
 * @param {string} priority
 */
export function alarmMark(priority) {
  const shape = SHAPES[/** @type {keyof typeof SHAPES} */ (priority)] ?? "?";
  const mark = made("span", shape, `mark mark-${priority}`);
  mark.setAttribute("aria-hidden", "true");
  return mark;
}

function watch() {
  const gist = byId("gist");
  const none = byId("no-data");
  const differs = byId("differs");
  onStatus((status) => {
    if (differs) {
      // a loop that tells no hash is an older one: nothing is known of its configuration
      const told = status.configuration_sha256 ?? "";
      const own = document.body.dataset.configuration ?? "";
      differs.hidden = told === "" || own === "" || told === own;
      const version = document.body.dataset.version ?? "";
      const running = status.program_version ?? version;
      show(differs, running === version
        ? word("common-differs")
        : word("common-differs_version", { told: running, own: version }));
    }
    if (gist) showGist(gist, status);
  });
  onLive(() => {
    document.body.dataset.live = "yes";
    if (none && !none.hidden) none.hidden = true;
  });
  onNoData((found) => {
    document.body.dataset.live = "no";
    if (differs) differs.hidden = true; // what the loop runs with now is not known
    if (!none) return;
    none.hidden = false;
    show(none, noDataWords(found));
  });
}

/**
 * State, reason and gravest alarm, on every page that is not about them.
 * @param {HTMLElement} gist
 * @param {import("./live.js").Status} status
 */
function showGist(gist, status) {
  const [state, reason, alarm] = /** @type {HTMLElement[]} */ ([...gist.children]);
  const [gravest, ...others] = status.alarms;
  const more = others.length ? `(${word("common-alarms", { count: status.alarms.length })})` : "";
  gist.dataset.state = status.state;
  show(state, status.state_said);
  show(reason, status.headline_said?.text ?? status.reasons_said.join(" "));
  alarm.hidden = !gravest;
  if (!gravest || alarm.title === `${gravest.text} ${more}`) return;
  alarm.title = `${gravest.text} ${more}`;
  alarm.replaceChildren(alarmMark(gravest.priority), ` ${alarm.title}`);
}

function tick() {
  const time = byId("time");
  if (time) show(time, clock(Date.now()));
}

function chooseTheme() {
  const root = document.documentElement;
  root.dataset.theme = root.dataset.theme === "dark" ? "light" : "dark";
  try {
    localStorage.setItem("theme", root.dataset.theme);
  } catch {
    // a browser that keeps nothing asks again next time
  }
  document.dispatchEvent(new CustomEvent("theme"));
}

function showNotice() {
  const notice = byId("notice");
  let text = null;
  try {
    text = sessionStorage.getItem("notice");
    sessionStorage.removeItem("notice");
  } catch {
    text = null;
  }
  byId("notice-close")?.addEventListener("click", () => { if (notice) notice.hidden = true; });
  if (text && document.body.dataset.page !== "login") say(text); // that page says why
}

/** @param {string} text */
function say(text) {
  const notice = byId("notice");
  if (!notice) return;
  notice.hidden = false;
  show(/** @type {HTMLElement} */ (notice.firstElementChild), text);
}

/**
 * Ask, and say it where that fails.
 * @param {string} path
 * @param {unknown} body
 * @returns {Promise<boolean>} whether it was done
 */
async function went(path, body) {
  try {
    const answer = await post(path, body);
    if (answer.ok) return true;
    const found = await answer.json().catch(() => ({}));
    say(found.text ?? word("history-no_answer"));
  } catch (error) {
    if (!(error instanceof TypeError)) throw error;
    say(word("history-no_answer"));
  }
  return false;
}

byId("theme")?.addEventListener("click", chooseTheme);
byId("language")?.addEventListener("change", async (event) => {
  const select = /** @type {HTMLSelectElement} */ (event.target);
  if (await went("/language", { language: select.value })) location.reload();
  else select.value = [...select.options].find((one) => one.defaultSelected)?.value ?? "";
});
byId("logout")?.addEventListener("click", async () => {
  if (!(await went("/logout", {}))) return;
  endKeeping();
  location.assign("/");
});
showNotice();
tick();
setInterval(tick, 1000);
if (document.body.dataset.viewing === "yes") {
  watch();
  startLive();
}
