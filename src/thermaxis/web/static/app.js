// @ts-check
// What every page of the app has: the address without its token, and the end of the program.

import { byId, made } from "./elements.js";
import { went } from "./page.js";
import { word } from "./words.js";

if (location.search) history.replaceState(null, "", location.pathname);
byId("app-end").addEventListener("click", async () => {
  if (confirm(word("app-end_sure")) && await went("/end", {})) byId("content").replaceChildren(made("p", word("app-ended"), "panel"));
});
