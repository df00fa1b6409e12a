// @ts-check
// A machine's story as charts, and what a person decides on a proposal.

import { drawChart } from "../chart/chart.js";
import { byId, made } from "../elements.js";
import { went } from "../page.js";
import { word } from "../words.js";

const SHOWN = /** @type {[string, string, string][]} */ ([
  ["rmse", word("fleet-rmse_of_night"), "solid"],
  ["mean", word("fleet-mean_of_night"), "dash"],
  ["offset_mae", word("fleet-offset_of_night"), "dot"],
]);
const story = JSON.parse(byId("story").textContent ?? "");

/**
 * Add a chart of the nights.
 * @param {string} place @param {string} title @param {import("../chart/chart.js").Chart} chart
 */
function add(place, title, chart) {
  const element = made("div", "", "fleet-chart");
  byId(place).append(made("h3", title), element);
  drawChart(element, { marks: story.marks, time: true, ...chart });
}

for (const { title, unit, t, y, low, high, limits } of story.evidence) {
  add("evidence", title, {
    marks: story.marks.filter((/** @type {{kind: string}} */ one) => one.kind === "alarm"),
    lines: [{ name: word("fleet-departure"), unit, x: t, y, low, high, digits: 2 }],
    bands: [{ high: limits[1], text: word("fleet-limit") },
      ...limits[0] === null ? [] : [{ low: limits[0] }]],
    yTitle: unit,
    label: `${title} ${word("fleet-departure")}`,
  });
}
for (const [name, some] of Object.entries(story.outputs)) {
  add("charts", name.replace(/_um$/, ""), {
    lines: SHOWN.map(([key, text, dash]) =>
      ({ name: text, unit: "µm", x: some.t, y: some[key], dash, digits: 2 })),
    yTitle: "µm",
    label: `${name} ${word("fleet-residual")}`,
  });
}
if (!Object.keys(story.outputs).length) byId("charts").append(word("fleet-no_figures"));

document.getElementById("decide")?.addEventListener("submit", async (event) => {
  event.preventDefault();
  const form = /** @type {HTMLFormElement} */ (event.target);
  const button = /** @type {HTMLButtonElement} */ (/** @type {SubmitEvent} */ (event).submitter);
  const done = await went("/decide", {
    machine: byId("machine").dataset.machine,
    sha256: form.dataset.sha256,
    accepted: button.value === "accept",
    why: String(new FormData(form).get("why") ?? ""),
  });
  if (done) location.reload();
});
