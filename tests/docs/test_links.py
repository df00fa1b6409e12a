"""Links between the Markdown pages lead somewhere."""

import re
from pathlib import Path
from urllib.parse import unquote

import pytest

LINK = re.compile(r"!?\[(?:[^\]\[]|\[[^\]]*\])*\]\(([^()\s]+(?:\([^()]*\))?)\)")
HEADING = re.compile(r"^#{1,6}\s+(.*?)\s*$", re.MULTILINE)
FENCE = re.compile(r"^```.*?^```\s*$", re.MULTILINE | re.DOTALL)
CODE = re.compile(r"`[^`\n]*`")


def without_code(text: str) -> str:
    return CODE.sub("", FENCE.sub("", text))


def slug(heading: str) -> str:
    """Return the anchor that GitHub makes of a heading."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").lower()
    return re.sub(r"[^\w\- ]", "", text).strip().replace(" ", "-")


def anchors(text: str) -> set[str]:
    found: set[str] = set()
    for heading in HEADING.findall(FENCE.sub("", text)):
        name, number = slug(heading), 0
        while (name if not number else f"{name}-{number}") in found:
            number += 1
        found.add(name if not number else f"{name}-{number}")
    return found


def broken_links(pages: dict[Path, str]) -> list[str]:
    broken: list[str] = []
    for page, text in pages.items():
        for link in LINK.findall(without_code(text)):
            if re.match(r"[a-z][a-z0-9+.-]*:", link):
                continue
            file, _, anchor = unquote(link).partition("#")
            target = (page.parent / file).resolve() if file else page
            if not target.exists():
                broken.append(f"{page.name}: {link} leads to no file")
            elif anchor and anchor not in anchors(pages.get(target, "")):
                broken.append(f"{page.name}: {link} leads to no heading")
    return broken


def test_every_link_leads_to_a_file_and_a_heading(pages):
    assert broken_links(pages) == []


def test_a_broken_link_is_noticed(root):
    text = "# One `x`, two\n[a](#one-x-two) [b](#three) [c](none.md) `[d](none.md)`\n"
    found = broken_links({root / "README.md": text})
    assert [link.split()[1] for link in found] == ["#three", "none.md"]


@pytest.mark.proof
def test_every_page_of_the_documentation_can_be_reached_from_the_readme(root, pages):
    reached, waiting = set(), [root / "README.md"]
    while waiting:
        page = waiting.pop()
        reached.add(page)
        for link in LINK.findall(without_code(pages.get(page, ""))):
            target = (page.parent / unquote(link).partition("#")[0]).resolve()
            if target.is_dir():
                waiting += [p for p in pages if p.parent == target and p not in reached]
            elif target in pages and target not in reached:
                waiting.append(target)
    docs = {page for page in pages if root / "docs" in page.parents}
    assert sorted(page.name for page in docs - reached) == []
