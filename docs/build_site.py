"""Build the documentation as a site: `make site` writes it to `build/site/html`.

Pages are those of `docs/`, staged in `build/site` with what they link to outside it. The tabs are
the sections of `index.md`, their entries the links that stand there. The reference has a page for
each public function and one for each package, made from docstrings. A dead link ends the build.
"""

import html
import importlib
import inspect
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from tests.docs.test_links import CODE, FENCE, LINK
from tests.docs.test_names import PUBLIC_PACKAGES, exported

ROOT = Path(__file__).resolve().parents[1]
STAGE = ROOT / "build" / "site"
BESIDE = "beside"  # what pages link to outside docs/
HEADING = re.compile(r"^## (.*)$", re.MULTILINE)
LINK_OR_CODE = re.compile(f"{FENCE.pattern}|{CODE.pattern}|{LINK.pattern}", FENCE.flags)
_VALUE = r"""=(?:"([^"]*)"|([^\s">]+))"""
LEADS_TO = re.compile(rf"<[a-z][^>]*?\s(?:href|src){_VALUE}")
ANCHOR = re.compile(rf"\s(?:id|name){_VALUE}")


def pages() -> Iterator[Path]:
    """Yield every page of the documentation."""
    yield from sorted((ROOT / "docs").rglob("*.md"))


def staged(text: str, page: Path, outside: set[Path]) -> str:
    """Return a page whose links to outside `docs/` lead to copies beside it."""

    def replaced(match: re.Match[str]) -> str:
        file, mark, anchor = (match[1] or "").partition("#")
        if not file or re.match(r"[a-z]+:", file):  # code has no target
            return match[0]
        target = (page.parent / file).resolve()
        if target.is_dir():
            target /= "README.md"
        inside = target.is_relative_to(ROOT / "docs")
        if not inside:
            outside.add(target)
        base = ROOT / "docs" if inside else ROOT
        place = target.relative_to(base) if inside else BESIDE / target.relative_to(base)
        here = page.relative_to(ROOT / "docs") if page.is_relative_to(ROOT / "docs") else None
        begin = here.parent if here else (BESIDE / page.relative_to(ROOT)).parent
        said = match[0][: match.start(1) - match.start()]
        return f"{said}{os.path.relpath(place, begin)}{mark}{anchor})"

    return LINK_OR_CODE.sub(replaced, text)


def summary(of: Any) -> str:
    """Return the first paragraph of a docstring in one line."""
    first = (inspect.getdoc(of) or "").partition("\n\n")[0]
    return " ".join(first.split())


def reference(folder: Path) -> list[dict[str, Any]]:
    """Write the pages of the public packages; return their place in the navigation."""
    entries: list[dict[str, Any]] = []
    for name in PUBLIC_PACKAGES:
        package = importlib.import_module(name)
        place = folder / name.removeprefix("thermaxis.").replace(".", "-")
        place.mkdir(parents=True)
        names = {one: getattr(package, one) for one in sorted(exported(package))}
        functions = {one: of for one, of in names.items() if inspect.isfunction(of)}
        classes = {one: of for one, of in names.items() if inspect.isclass(of)}
        lines = [f"# {name}", "", summary(package), "", "## Functions", ""]
        for one, of in functions.items():
            lines.append(f"- [`{one}`]({one}.md): {summary(of)}")
            (place / f"{one}.md").write_text(
                f"::: {of.__module__}.{of.__qualname__}\n    options:\n      heading_level: 1\n"
                f"      show_root_heading: true\n\n`from {name} import {one}`\n",
                encoding="utf-8",
            )
        lines += ["", "## Classes", ""]
        lines += [
            f"- [`{one}`](classes.md#{one.lower()}): {summary(of)}" for one, of in classes.items()
        ]
        (place / "index.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
        told = [
            f"## {one}\n\n::: {of.__module__}.{of.__qualname__}\n" for one, of in classes.items()
        ]
        head = f"# Classes of {name}\n\n`from {name} import ...`\n\n"
        (place / "classes.md").write_text(head + "\n".join(told), encoding="utf-8")
        inner = [f"reference/{place.name}/{page}.md" for page in ("index", "classes", *functions)]
        entries.append({name: inner})
    return entries


def navigation() -> list[dict[str, Any]]:
    """Return the tabs: the sections of the first page with the links that stand in each."""
    index = ROOT / "docs" / "index.md"
    _, *parts = HEADING.split(staged(index.read_text(encoding="utf-8"), index, set()))
    return [
        {title: list(dict.fromkeys(link.partition("#")[0] for link in LINK.findall(body)))}
        for title, body in zip(parts[::2], parts[1::2], strict=True)
    ]


def settings(tabs: list[dict[str, Any]]) -> dict[str, Any]:
    """Return what the builder is told."""
    options = {
        "docstring_style": "numpy",
        "show_root_heading": False,
        "show_root_full_path": False,
        "show_root_toc_entry": False,
        "show_source": False,
        "separate_signature": True,
        "show_signature_annotations": True,
        "show_bases": False,
        "heading_level": 3,
        "members_order": "source",
        "filters": ["!^_"],
    }
    palette = [
        {
            "media": f"(prefers-color-scheme: {scheme})",
            "scheme": {"light": "default", "dark": "slate"}[scheme],
            "toggle": {"icon": "material/brightness-6", "name": f"Light or dark: {scheme}"},
        }
        for scheme in ("light", "dark")
    ]
    return {
        "site_name": "thermaxis",
        "site_description": "Accurate machine tools while they warm up",
        "docs_dir": "pages",
        "site_dir": "html",
        "use_directory_urls": False,  # pages open from a folder, without a server
        "theme": {
            "name": "material",
            "font": False,  # nothing is asked for from outside
            "features": [
                "navigation.tabs",
                "navigation.indexes",
                "navigation.prune",
                "navigation.top",
                "search.highlight",
            ],
            "palette": palette,
        },
        "plugins": [
            "search",
            {
                "mkdocstrings": {
                    "handlers": {"python": {"paths": [str(ROOT / "src")], "options": options}}
                }
            },
        ],
        "markdown_extensions": [
            "tables",
            "toc",
            "pymdownx.superfences",
            "pymdownx.highlight",
            "md_in_html",
        ],
        "nav": [{"thermaxis": "index.md"}, *tabs],
    }


def dead_links(site: Path) -> list[str]:
    """Return the links of built pages that lead to no file or to no anchor of a page."""
    texts = {page: page.read_text(encoding="utf-8") for page in sorted(site.rglob("*.html"))}
    anchors = {page: {a or b for a, b in ANCHOR.findall(text)} for page, text in texts.items()}
    dead: list[str] = []
    for page, text in texts.items():
        for link in dict.fromkeys(html.unescape(a or b) for a, b in LEADS_TO.findall(text)):
            if re.match(r"[a-z]+:|//", link):
                continue
            file, _, anchor = unquote(link).partition("#")
            start = site if file.startswith("/") else page.parent
            target = (start / file.lstrip("/").partition("?")[0]).resolve() if file else page
            if not target.is_file() or anchor not in {"", *anchors.get(target, (anchor,))}:
                dead.append(f"{page.relative_to(site)}: {link}")
    return dead


def build() -> int:
    """Stage all pages and build the site; 0 if every link leads somewhere."""
    shutil.rmtree(STAGE, ignore_errors=True)
    outside: set[Path] = set()
    for page in pages():
        place = STAGE / "pages" / page.relative_to(ROOT / "docs")
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(staged(page.read_text(encoding="utf-8"), page, outside), encoding="utf-8")
    for picture in (ROOT / "docs").rglob("*.[ps][nv]g"):
        place = STAGE / "pages" / picture.relative_to(ROOT / "docs")
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(picture, place)
    done: set[Path] = set()
    while outside - done:
        for file in sorted(outside - done):
            done.add(file)
            place = STAGE / "pages" / BESIDE / file.relative_to(ROOT)
            place.parent.mkdir(parents=True, exist_ok=True)
            if file.suffix == ".md":
                text = staged(file.read_text(encoding="utf-8"), file, outside)
                place.write_text(text, encoding="utf-8")
            else:
                shutil.copy(file, place)
    tabs = [*navigation(), {"Python": reference(STAGE / "pages" / "reference")}]
    (STAGE / "mkdocs.yml").write_text(json.dumps(settings(tabs), indent=1), encoding="utf-8")
    builder = [Path(sys.executable).with_name("zensical"), "build", "--clean", "--strict"]
    words = [*builder, "-f", STAGE / "mkdocs.yml"]
    code = subprocess.run(words, check=False).returncode  # noqa: S603  our own words
    if not code:
        index = STAGE / "html" / "search.json"  # fields of classes would hide the pages
        found = json.loads(index.read_text(encoding="utf-8"))
        found["items"] = [one for one in found["items"] if "-attribute<" not in one["title"]]
        index.write_text(json.dumps(found), encoding="utf-8")
    dead = dead_links(STAGE / "html")
    sys.stderr.writelines(f"dead link: {link}\n" for link in dead)
    return code or int(bool(dead))


if __name__ == "__main__":
    sys.exit(build())
