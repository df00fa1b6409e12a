"""The site is built strictly, finds every page, and asks nothing of the network."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from docs.build_site import ROOT, STAGE, build, dead_links, navigation, pages, staged
from tests.docs.test_links import LINK, without_code

ASSET = re.compile(r"<(?:script|link|img|iframe)\b[^>]*?\b(?:src|href)=\"?(https?:[^\" >]+)")


@pytest.fixture(scope="module")
def site() -> Path:
    assert build() == 0
    return STAGE / "html"


def test_every_page_is_behind_a_door_or_linked_from_one_that_is(root: Path) -> None:
    waiting = [link for tab in navigation() for links in tab.values() for link in links]
    reached: set[Path] = set()
    while waiting:
        page = (root / "docs" / waiting.pop()).resolve()
        if page.suffix != ".md" or page in reached or not page.is_file():
            continue
        reached.add(page)
        folder = page.parent
        links = LINK.findall(without_code(page.read_text(encoding="utf-8")))
        waiting += [str(folder / link.partition("#")[0]) for link in links if ":" not in link]
    unreached = set(pages()) - reached - {root / "docs" / "index.md"}
    assert sorted(str(page.relative_to(root)) for page in unreached) == []


def test_links_to_outside_are_rewritten_even_with_code_in_their_text_and_code_is_not() -> None:
    outside: set[Path] = set()
    text = "[a](../../x.toml) [`b`](../../x.toml#c) `[d](../../x.toml)` [e](f.md) [x](https://y)\n"
    found = staged(text, ROOT / "docs" / "how-to" / "page.md", outside)
    assert found == (
        "[a](../beside/x.toml) [`b`](../beside/x.toml#c) `[d](../../x.toml)` [e](f.md)"
        " [x](https://y)\n"
    )
    assert outside == {ROOT / "x.toml"}


def test_links_of_built_pages_without_file_or_anchor_are_found(tmp_path: Path) -> None:
    links = ("#b", "p.html#c", "p.html#d", "none.toml", "/p.html?q", "/none.html", "https://y")
    text = '<h1 id="b"></h1>' + "".join(f'<a href="{link}">l</a>' for link in links)
    (tmp_path / "index.html").write_text(text, "utf-8")
    (tmp_path / "p.html").write_text("<h1 id=c></h1><img src=gone.png>", "utf-8")
    assert dead_links(tmp_path.resolve()) == [
        "index.html: p.html#d",
        "index.html: none.toml",
        "index.html: /none.html",
        "p.html: gone.png",
    ]


def test_the_notebooks_have_a_door() -> None:
    links = [link for tab in navigation() for links in tab.values() for link in links]
    assert "beside/notebooks/README.md" in links


@pytest.mark.proof
def test_it_is_built_strictly_and_its_pages_load_nothing_from_outside(site: Path) -> None:
    built = list(site.rglob("*.html"))
    assert len(built) > 350
    asked = {str(page.name): ASSET.findall(page.read_text("utf-8")) for page in built}
    assert {page: urls for page, urls in asked.items() if urls} == {}


@pytest.mark.proof
def test_the_search_finds_guides_and_public_functions(site: Path) -> None:
    items = json.loads((site / "search.json").read_text("utf-8"))["items"]
    places = {item["location"].partition("#")[0] for item in items}
    assert {"how-to/fleet.html", "reference/positioning/evaluate_iso230_2.html"} <= places
    function = (site / "reference" / "positioning" / "evaluate_iso230_2.html").read_text("utf-8")
    assert "Iso230_2Result" in function
    assert "DataError" in function


@pytest.mark.proof
def test_a_dead_link_ends_the_build(tmp_path: Path) -> None:
    (tmp_path / "pages").mkdir()
    settings = {"site_name": "x", "docs_dir": "pages", "site_dir": "html"}
    (tmp_path / "mkdocs.yml").write_text(json.dumps(settings), encoding="utf-8")
    builder = Path(sys.executable).with_name("zensical")
    words = [builder, "build", "--strict", "-f", tmp_path / "mkdocs.yml"]
    for text, code in (("# A\n\n[b](#a)\n", 0), ("# A\n\n[b](none.md)\n", 1)):
        (tmp_path / "pages" / "index.md").write_text(text, encoding="utf-8")
        assert subprocess.run(words, check=False, capture_output=True).returncode == code
