// @ts-check
// The log-in: why it is needed, whether the loop is there, and the form.

import { post } from "./page.js";
import { noDataWords } from "./live.js";
import { word } from "./words.js";

const LOOK_MS = 2000;
const LONGEST_MS = 5000;

const form = /** @type {HTMLFormElement} */ (document.getElementById("login"));
const wrong = document.getElementById("wrong");
const why = document.getElementById("why");
const viewing = document.body.dataset.viewing === "yes"; // then the head of the page says more
const loop = viewing ? null : document.getElementById("loop");

/** @param {HTMLElement | null} element @param {string} text */
function say(element, text) {
  if (!element) return;
  element.hidden = text === "";
  if (element.textContent !== text) element.textContent = text;
}

/** A page of this server, never another address. */
function next() {
  const wanted = new URLSearchParams(location.search).get("next") ?? "/";
  const target = new URL(wanted, location.origin);
  return target.origin === location.origin ? target.pathname : "/";
}

/** Look again and again: the page renews itself, whatever ends and comes back meanwhile. */
async function look() {
  try {
    const signal = AbortSignal.timeout(LONGEST_MS);
    const answer = await fetch("/login/state", { cache: "no-store", signal });
    const state = await answer.json();
    say(why, state.why);
    say(loop, state.live ? state.text : noDataWords(state));
    loop?.setAttribute("data-live", state.live ? "yes" : "no");
  } catch {
    say(loop, word("common-no_connection_to_screen"));
    loop?.setAttribute("data-live", "no");
  }
  setTimeout(look, LOOK_MS);
}

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  const entered = new FormData(form);
  const button = form.querySelector("button");
  if (button) button.disabled = true;
  try {
    const secret = entered.get("pin") ? "pin" : "password";
    const answer = await post("/login", {
      name: String(entered.get("name") ?? "").trim(),
      [secret]: String(entered.get(secret) ?? ""),
    });
    if (answer.ok) {
      location.assign(next());
      return;
    }
    say(wrong, (await answer.json()).text);
  } catch {
    say(wrong, word("common-no_connection_to_screen"));
  } finally {
    if (button) button.disabled = false;
  }
});

void look();
