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

for (const [name, some] of Object.entries(story.outputs)) {
  const chart = made("div", "", "fleet-chart");
  byId("charts").append(made("h3", name.replace(/_um$/, "")), chart);
  drawChart(chart, {
    lines: SHOWN.map(([key, text, dash]) =>
      ({ name: text, unit: "µm", x: some.t, y: some[key], dash, digits: 2 })),
    marks: story.marks,
    time: true,
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
