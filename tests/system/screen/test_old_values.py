"""Without data nothing that the loop told stands on any page as if it were so now.

What comes from the loop is not listed here: it is whatever a page shows with data, and does not
show when it was opened without any. Each of it must be marked once the data are gone.
"""

from collections.abc import Callable, Generator
from contextlib import suppress
from typing import Final

import pytest
from playwright.sync_api import Page

from tests.system.screen.conftest import Looked
from tests.system.screen.stand import Rig, wait_until

Look = Callable[..., Looked]
PAGES: Final = ("/", "/model", "/sensors", "/history", "/probe", "/positioning")
LIVE: Final = {"/": 20, "/model": 2, "/sensors": 15, "/probe": 1}
"""So many texts of the loop a page has at least: the test sees them. [1]"""

# Every text that is seen, and whether an element that it stands in marks it as old: crossed out,
# underlined by dots, or ending in a question mark. Names, units, rules are no values. Charts show
# the past, by their axis; what the model's page has from the file stays true (test_chart.py judges
# what stands between it).
TEXTS: Final = """() => {
  const apart = "script, svg, select, #time, #no-data, .op-state, nav, .notice, .past-main,"
    + " .past-more, .past-events, .past-bar, .past-trend, .unseen, .op-chart, #trend-told,"
    + " .op-card-name, .op-label, .op-headline p:first-child, #state-since, #helps, .range-ends,"
    + " #others h2, th,"
    + " #others td:first-child, [id^=range-], #ratio,"
    + " #model-outputs, #model-references, #model-provenance, #model-facts, #model-warnings, #told";
  const marks = (e) => {
    const own = getComputedStyle(e);
    const after = getComputedStyle(e, "::after").content;
    return own.textDecorationLine.includes("line-through")
      || own.textDecorationStyle === "dotted" || after.includes("?");
  };
  const found = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode;
    const text = node.textContent.trim();
    const e = node.parentElement;
    if (!text || e.closest(apart) || !e.getClientRects().length) continue;
    if (parseFloat(getComputedStyle(e).fontSize) === 0) continue;
    let marked = /\\?|unknown/.test(text);
    for (let at = e; at && at !== document.body; at = at.parentElement) marked ||= marks(at);
    found.push({ text, marked, where: `${e.tagName} ${e.id} ${e.className}` });
  }
  return found;
}"""


@pytest.fixture(scope="module")
def lonely(tmp_path_factory: pytest.TempPathFactory) -> Generator[Rig]:
    """Yield a stand on which anybody may look; its loop is stopped here."""
    with Rig(tmp_path_factory.mktemp("old"), view_without_login=True) as found:
        operator = found.visitor()
        assert operator.log_in("operator").status == 200
        for method, arguments in (("Enable", ()), ("Trim", ("Z_um", 2.0, 600.0))):
            assert operator.request(method, *arguments)["answer"] == "accepted"
        wait_until("an offset in the lathe", lambda: abs(found.offset_um()) > 5.0)
        yield found


def texts(page: Page) -> list[dict[str, str | bool]]:
    found: list[dict[str, str | bool]] = page.evaluate(TEXTS)
    return found


def plain_texts(old: list[dict[str, str | bool]], page: Page) -> list[dict[str, str | bool]]:
    """Return what was seen before, is not known without the loop, and was not marked as old."""
    known = {one["text"] for one in texts(page)}
    return [one for one in old if one["text"] not in known and not one["marked"]]


def test_every_value_of_the_loop_is_marked_on_every_page_while_there_are_no_data(
    look: Look, lonely: Rig
) -> None:
    seen = {path: look(of=lonely) for path in PAGES}
    live: dict[str, list[dict[str, str | bool]]] = {}
    for path, looked in seen.items():
        looked.open(path)
        looked.wait_live()
    for path, looked in seen.items():
        looked.wait_idle()
        live[path] = texts(looked.page)
    assert not [one for path in PAGES for one in live[path] if one["marked"]]
    lonely.kill("run")
    for looked in seen.values():
        looked.page.wait_for_selector('body[data-live="no"]')
    old = {path: texts(looked.page) for path, looked in seen.items()}
    lonely.kill("screen")
    lonely.start_screen()
    for path, looked in seen.items():
        looked.open(path)
        looked.page.wait_for_selector('body[data-live="no"]')
        looked.wait_idle()  # what it asks for itself has come, or comes soon
        with suppress(AssertionError):
            wait_until("it", lambda p=path, one=looked.page: not plain_texts(old[p], one))
        plain = plain_texts(old[path], looked.page)
        assert not plain, f"{path}: {plain}"
        known = {one["text"] for one in texts(looked.page)}
        told = [one for one in live[path] if one["text"] not in known]
        assert len(told) >= LIVE.get(path, 0), f"{path}: {told}"
    lonely.start_loop()
