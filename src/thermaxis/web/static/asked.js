// @ts-check
// Asking the screen's server for values.

import { word } from "./words.js";

/** What the server, or the page itself, refuses in words that are told to people. */
export class Refused extends Error {}

/**
 * Ask the server. That it refuses, does not answer or breaks off is thrown in words.
 * @param {string} path
 * @param {RequestInit} [how]
 * @param {(answer: Response) => Promise<any>} [read]
 * @returns {Promise<any>}
 */
export async function asked(path, how = {}, read = (answer) => answer.json()) {
  let text = "";
  try {
    const answer = await fetch(path, how);
    if (answer.ok) return await read(answer);
    text = (await answer.json()).text;
  } catch (error) {
    if (how.signal?.aborted) throw error;
  }
  throw new Refused(text || word("history-no_answer"));
}
