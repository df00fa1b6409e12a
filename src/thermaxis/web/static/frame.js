// @ts-check
// What every page of the screen has: state, alarms, NO DATA, time of day, log-out.

import { made, say as show } from "./elements.js";
import { noDataWords, onLive, onNoData, onStatus, startLive } from "./live.js";
import "./page.js";
import { clock, word } from "./words.js";

/** @param {string} id */
function byId(id) {
  return document.getElementById(id);
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
  show(reason, status.headline_said?.text ?? "");
  alarm.hidden = !gravest;
  if (!gravest || alarm.title === `${gravest.text} ${more}`) return;
  alarm.title = `${gravest.text} ${more}`;
  alarm.replaceChildren(alarmMark(gravest.priority), ` ${alarm.title}`);
}

function tick() {
  const time = byId("time");
  if (time) show(time, clock(Date.now()));
}

tick();
setInterval(tick, 1000);
watch();
startLive();
