"""What stays on a page after a question that failed, by the script that history and probe share."""

from typing import Any

from tests.unit.screen.page_script import said_by
from thermaxis.web import asset_folder

SCRIPT = asset_folder() / "history/past.js"
BENCH = """
const places = {};
class Place {
  dataset = {};
  textContent = "";
  replaceChildren(...nodes) { this.textContent = nodes.join(""); }
}
globalThis.document = {
  body: { dataset: {} },
  documentElement: { lang: "en" },
  getElementById: (id) => id === "words" ? null : (places[id] ??= new Place()),
};
const past = await import("file://SCRIPT");
const { asked, Refused } = await import("file://ASKED");
const { refused, shows } = past;
const isFormer = () => places.content.dataset.former === "yes";
process.stdout.write(JSON.stringify(await (async () => { BODY })()));
"""


def said(body: str) -> Any:
    """Return what a script says that has the module's functions."""
    bench = BENCH.replace("SCRIPT", str(SCRIPT)).replace("ASKED", str(asset_folder() / "asked.js"))
    return said_by(bench.replace("BODY", body))


def test_what_stands_there_is_marked_from_a_refusal_until_an_answer() -> None:
    found = said(
        """
        refused(new Refused("no"));
        const first = [isFormer(), places.wrong.textContent];
        shows({ first: 0, last: 10 });
        const shown = [isFormer(), places.wrong.textContent];
        refused(new Refused("no"));
        const marked = [isFormer(), places.wrong.textContent];
        shows({ first: 1, last: 11 });
        return [first, shown, marked, isFormer()];
        """
    )
    assert found == [[False, "no"], [False, ""], [True, "no history-former"], False]


def test_an_answer_that_breaks_off_is_a_refusal_in_words() -> None:
    found = said(
        """
        globalThis.fetch = async () => ({ ok: true, json: async () => JSON.parse("{") });
        try { await asked("/history/series"); } catch (error) { return error instanceof Refused; }
        """
    )
    assert found is True
