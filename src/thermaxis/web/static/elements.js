// @ts-check
// Elements of a page: found, made, and written only where that changes something.

const ENGLISH = /[\u2068\u2069]/; // around what is English within a text of another language

/** @param {string} id @returns {HTMLElement} */
export function byId(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no element ${id}`);
  return found;
}

/**
 * @param {string} tag
 * @param {string} [text]
 * @param {string} [name] name of its class
 * @param {(Node | string)[]} inner what stands in it behind the text
 * @returns {HTMLElement}
 */
export function made(tag, text = "", name = "", ...inner) {
  const element = document.createElement(tag);
  element.append(...nodesOf(text), ...inner);
  if (name) element.className = name;
  return element;
}

/**
 * @param {string} text
 * @param {() => void} act
 * @param {string} [label] what it does, where the text does not say it
 */
export function button(text, act, label = "") {
  const found = /** @type {HTMLButtonElement} */ (made("button", text));
  found.type = "button";
  if (label) found.setAttribute("aria-label", label);
  found.addEventListener("click", act);
  return found;
}

/**
 * A text as nodes, those parts of it marked that are English on a page of another language: a
 * screen reader speaks them as English.
 * @param {string} text
 * @returns {(string | HTMLElement)[]}
 */
function nodesOf(text) {
  return text.split(ENGLISH).map((part, k) => k % 2 ? inEnglish("span", part) : part)
    .filter((node) => node !== "");
}

/** Whether a part of a text is English on a page of another language. @param {string} text */
export function hasEnglish(text) {
  return ENGLISH.test(text);
}

/**
 * An element with an English text.
 * @param {string} tag
 * @param {string} text
 */
export function inEnglish(tag, text) {
  const element = document.createElement(tag);
  element.textContent = text;
  element.lang = "en";
  return element;
}

/**
 * Write a text, only if it is another one: who is reading it is not disturbed.
 * @param {Element | null | undefined} element
 * @param {string} text
 */
export function say(element, text) {
  if (!element || element.textContent === text) return;
  const nodes = nodesOf(text);
  const plain = nodes.map((node) => typeof node === "string" ? node : node.textContent).join("");
  if (element.textContent !== plain) element.replaceChildren(...nodes);
}

/** Load a style where it is not there yet. @param {string} file */
export function style(file) {
  if (document.querySelector(`link[href*="${file}"]`)) return;
  const link = document.createElement("link");
  link.rel = "stylesheet";
  link.href = new URL(`./${file}`, import.meta.url).href;
  document.head.append(link);
}
