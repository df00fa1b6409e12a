// @ts-check
// The log-in.

import { post } from "./frame.js";
import { word } from "./words.js";

const form = /** @type {HTMLFormElement} */ (document.getElementById("login"));
const wrong = document.getElementById("wrong");

/** @param {string} text */
function refused(text) {
  if (!wrong) return;
  wrong.hidden = false;
  wrong.textContent = text;
}

/** A page of this server, never another address. */
function next() {
  const wanted = new URLSearchParams(location.search).get("next") ?? "/";
  const target = new URL(wanted, location.origin);
  return target.origin === location.origin ? target.pathname : "/";
}

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  const entered = new FormData(form);
  const button = form.querySelector("button");
  if (button) button.disabled = true;
  try {
    const answer = await post("/login", {
      name: String(entered.get("name") ?? "").trim(),
      password: String(entered.get("password") ?? ""),
    });
    if (answer.ok) {
      location.assign(next());
      return;
    }
    refused((await answer.json()).text);
  } catch {
    refused(word("common.no_connection_to_screen"));
  } finally {
    if (button) button.disabled = false;
  }
});
