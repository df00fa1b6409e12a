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
const { asked, Refused, refused, shows, told } = past;
const span = (first) => ({ first, last: first + 10 });
const of = (at, ...chosen) => ({ span: at, of: chosen, said: chosen.join() });
const isFormer = () => places.content.dataset.former === "yes";
process.stdout.write(JSON.stringify(await (async () => { BODY })()));
"""


def said(body: str) -> Any:
    """Return what a script says that has the module's functions."""
    return said_by(BENCH.replace("SCRIPT", str(SCRIPT)).replace("BODY", body))


def test_what_stands_there_is_marked_unless_it_is_of_just_what_was_asked() -> None:
    for stated, former in (
        ("of(span(0), 'A')", False),
        ("of(span(1), 'A')", True),
        ("of(span(0), 'A', 'B')", True),
        ("of(null, 'A')", True),
    ):
        found = said(
            f"""
            shows(of(span(0), 'A'));
            refused(new Refused("no"), {stated});
            const marked = isFormer();
            shows({stated});
            return [marked, isFormer(), places.wrong.textContent];
            """
        )
        assert found == [former, False, "no"], stated


def test_an_answer_that_breaks_off_is_a_refusal_in_words() -> None:
    found = said(
        """
        globalThis.fetch = async () => ({ ok: true, json: async () => JSON.parse("{") });
        try { await asked("/history/series"); } catch (error) { return error instanceof Refused; }
        """
    )
    assert found is True
