// @ts-check
// Light or dark is set before the first picture of the page, so that it does not flash.

(function () {
  let chosen = null;
  try {
    chosen = localStorage.getItem("theme");
  } catch {
    chosen = null; // a browser that keeps nothing follows the system
  }
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  document.documentElement.dataset.theme = chosen === "light" || chosen === "dark"
    ? chosen
    : dark ? "dark" : "light";
})();
