// @ts-check
// What every page has: language, theme, a line for what failed.

import { say as show } from "./elements.js";
import { word } from "./words.js";

/** @param {string} id */
function byId(id) {
  return document.getElementById(id);
}

/**
 * Ask the server of this page for something.
 * @param {string} path
 * @param {unknown} body a text or content is sent as it is, all else as JSON
 * @param {AbortSignal} [signal] ends it
 */
export async function post(path, body, signal = undefined) {
  const asIs = typeof body === "string" || body instanceof Blob;
  return fetch(path, {
    method: "POST",
    signal,
    headers: {
      "Content-Type": asIs ? "application/octet-stream" : "application/json",
      "X-Thermaxis-Token": document.body.dataset.token ?? "",
    },
    body: asIs ? /** @type {BodyInit} */ (body) : JSON.stringify(body),
  });
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
export async function went(path, body) {
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
  location.assign("/");
  sessionStorage.clear(); // whoever comes finds nothing of who was here
});
showNotice();
