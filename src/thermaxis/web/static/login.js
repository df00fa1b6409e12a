// @ts-check
// The log-in.

import { post } from "./page.js";
import { word } from "./words.js";

const form = /** @type {HTMLFormElement} */ (document.getElementById("login"));
const wrong = document.getElementById("wrong");

/** @param {string} text */
function say(text) {
  if (!wrong) return;
  wrong.hidden = false;
  wrong.textContent = text;
}

/** A page of this server, never another address. */
function next() {
  const wanted = new URLSearchParams(location.search).get("next") ?? "/";
  const target = new URL(wanted, location.origin);
  const own = target.origin === location.origin && !target.pathname.startsWith("//");
  return own ? target.pathname + target.search : "/";
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
    say((await answer.json()).text);
  } catch {
    say(word("common-no_connection_to_screen"));
  } finally {
    if (button) button.disabled = false;
  }
});
