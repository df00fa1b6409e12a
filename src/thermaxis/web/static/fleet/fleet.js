// @ts-check
// What every page of a fleet has: see page.js.

import "../page.js";
