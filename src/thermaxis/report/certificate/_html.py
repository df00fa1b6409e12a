"""The certificate as one HTML page that needs no other file."""

import re
from collections.abc import Iterator
from html import escape

from thermaxis.report._document import (
    Block,
    Document,
    Fields,
    ItemList,
    Paragraph,
    Picture,
    Section,
    Signature,
    Table,
    Verdict,
)

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
_STYLE = """
:root { color-scheme: light; }
body { font: .95rem/1.4 system-ui, "DejaVu Sans", sans-serif; color: #111; background: #fff;
  max-width: 60rem; margin: 2rem auto; padding: 0 1rem; overflow-wrap: anywhere; }
h1 { font-size: 1.6rem; margin: 0 0 .2rem; }
h2 { font-size: 1.15rem; margin: 2rem 0 .6rem; border-top: 2px solid #111; padding-top: .5rem; }
h3 { font-size: .95rem; margin: 1rem 0 .3rem; }
.subtitle { margin: 0 0 1rem; }
.issuer { margin: 0; font-size: .87rem; } .issuer:first-child { font-weight: bold; }
.issuer + h1 { margin-top: 1rem; }
.verdict { border: 2px solid #111; padding: .8rem 1rem; margin: 1rem 0; display: flex; gap: 1.2rem;
  align-items: center; }
.verdict.alarm { border-width: 5px; }
.verdict p { margin: 0; } .verdict .reservation { margin-top: .4rem; font-weight: bold; }
.verdict strong { font-size: 1.7rem; white-space: nowrap; }
dl { display: grid; grid-template-columns: 11rem 1fr 11rem 1fr;
  gap: .2rem .8rem; margin: .3rem 0 .6rem; font-size: .87rem; border-bottom: 1px solid #bbb;
  padding-bottom: .5rem; }
dl.code { grid-template-columns: 16rem 1fr; }
dl.code dd { font-family: "DejaVu Sans Mono", monospace; font-size: .8rem; }
dt { color: #444; } dd { margin: 0; }
.signature { display: flex; gap: 3rem; margin-top: 4rem; font-size: .87rem; color: #444; }
.signature span { flex: 1; border-top: 1px solid #888; }
.scroll { overflow-x: auto; margin: .6rem 0 1rem; }
table { border-collapse: collapse; font-size: .87rem; font-variant-numeric: tabular-nums;
  border-top: 2px solid #111; border-bottom: 2px solid #111; overflow-wrap: normal; }
.caption { font-size: .87rem; font-style: italic; margin: 1rem 0 .3rem; break-after: avoid; }
th { border-bottom: 2px solid #111; }
th, td { padding: .18rem .5rem; text-align: right; white-space: nowrap; }
.left { text-align: left; } .center { text-align: center; }
td.wide { white-space: normal; overflow-wrap: anywhere; }
tr.strong td { font-weight: bold; }
table.dense:not(:has(.strong)) tr:is(:nth-child(4n+3), :nth-child(4n)) td { background: #eee; }
table.dense tr.strong td { border-bottom: 1px solid #999; }
table.dense { font-size: .72rem; } table.dense th, table.dense td { padding: .05rem .3rem; }
figure { margin: 1.2rem 0; } figure svg { width: 100%; height: auto; }
figure svg * { stroke-linejoin: round; stroke-linecap: butt; }
figcaption { font-style: italic; font-size: .87rem; }
ol, ul { font-size: .87rem; padding-left: 1.4rem; }
footer { margin-top: 2rem; border-top: 1px solid #888; font-size: .8rem; color: #333; }
@page { size: A4; margin: 15mm; @bottom-right { content: counter(page) " of " counter(pages); } }
@media print {
  html { font-size: 11.5px; }
  body { margin: 0; max-width: none; padding: 0; }
  figure, dl, tr, .verdict, .signature { break-inside: avoid; }
  h2, h3 { break-after: avoid; }
  .scroll { overflow: visible; }
  header table { font-size: .8rem; } header figure svg { max-height: 7.5cm; }
  figure svg { max-height: 12cm; } .signature { margin-top: 2rem; }
  table.dense { font-size: 6.5pt; } table.dense th, table.dense td { padding: 0 .25em; }
}
"""


def render_html(document: Document) -> str:
    """Return a document as one HTML page; every text in it is escaped."""
    pictures = iter(range(1, 1000))
    title = escape(document.title)
    lines = [
        "<!DOCTYPE html>",
        '<html lang="en">',
        "<head>",
        '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<meta name="generator" content="{escape(document.author)}">',
        f"<title>{title}</title>",
        f"<style>{_STYLE}{_foot_of_pages(document)}</style>",
        "</head>",
        "<body>",
        "<header>",
        *(f'<p class="issuer">{escape(line)}</p>' for line in document.issuer),
        f"<h1>{title}</h1>",
        f'<p class="subtitle">{escape(document.subtitle)}</p>',
        *(_block(block, pictures) for block in document.opening),
        "</header>",
        "<main>",
        *(_section(section, pictures) for section in document.sections),
        f"<p>{escape(document.end)}</p>" if document.end else "",
        "</main>",
        f"<footer><p>{escape(document.footer)} · {escape(document.author)}</p></footer>",
        "</body>",
        "</html>",
        "",
    ]
    return "\n".join(lines)


def _foot_of_pages(document: Document) -> str:
    """Return the style that prints the foot on every page; no character of it acts in a style."""
    escaped = (c if c.isascii() and c.isalnum() else f"\\{ord(c):x} " for c in document.footer)
    return f'@page {{ @bottom-left {{ font-size: 8pt; content: "{"".join(escaped)}"; }} }}\n'


def _section(section: Section, pictures: Iterator[int]) -> str:
    blocks = "\n".join(_block(block, pictures) for block in section.blocks)
    return f"<section>\n<h2>{escape(section.heading)}</h2>\n{blocks}\n</section>"


def _block(block: Block, pictures: Iterator[int]) -> str:
    match block:
        case Table():
            return _table(block)
        case Fields():
            return _fields(block)
        case Picture():
            return _picture(block, next(pictures))
        case Verdict():
            return _verdict(block)
        case _:
            return _text(block)


def _text(block: Paragraph | ItemList | Signature) -> str:
    match block:
        case Paragraph():
            text = escape(block.text)
            return f"<p><strong>{text}</strong></p>" if block.strong else f"<p>{text}</p>"
        case ItemList():
            tag = "ol" if block.numbered else "ul"
            items = "".join(f"<li>{escape(item)}</li>" for item in block.items)
            return f"<{tag}>{items}</{tag}>"
        case Signature():
            lines = "".join(f"<span>{escape(label)}</span>" for label in block.labels)
            return f'<div class="signature">{lines}</div>'


def _verdict(verdict: Verdict) -> str:
    plain = verdict.word == "PASS" and not verdict.reservation
    kind = "verdict" if plain else "verdict alarm"
    word, text = escape(verdict.word), f"<p>{escape(verdict.sentence)}</p>"
    if verdict.reservation:
        text += f'<p class="reservation">{escape(verdict.reservation)}</p>'
    return f'<div class="{kind}"><strong>{word}</strong><div>{text}</div></div>'


def _table(table: Table) -> str:
    classes = [
        " ".join(filter(None, (c.align if c.align != "right" else "", "wide" * c.wide)))
        for c in table.columns
    ]
    attributes = [f' class="{name}"' if name else "" for name in classes]
    head = "".join(
        f'<th scope="col"{attribute}>{escape(column.label)}</th>'
        for column, attribute in zip(table.columns, attributes, strict=True)
    )
    strong = ["<tr>", '<tr class="strong">']
    rows = "\n".join(
        strong[number in table.strong_rows]
        + "".join(
            f"<td{attribute}>{escape(cell)}</td>"
            for cell, attribute in zip(row, attributes, strict=True)
        )
        + "</tr>"
        for number, row in enumerate(table.rows)
    )
    # a caption element would be as narrow as its table
    caption = f'<p class="caption">{escape(table.caption)}</p>\n' if table.caption else ""
    dense = ' class="dense"' if table.dense else ""
    return (
        f'{caption}<div class="scroll"><table{dense}>\n<thead><tr>{head}</tr></thead>\n'
        f"<tbody>\n{rows}\n</tbody></table></div>"
    )


def _fields(fields: Fields) -> str:
    heading = f"<h3>{escape(fields.title)}</h3>" if fields.title else ""
    items = "".join(
        f"<dt>{escape(label)}</dt><dd>{escape(value)}</dd>" for label, value in fields.fields
    )
    opening = '<dl class="code">' if fields.code else "<dl>"
    return f"{heading}{opening}{items}</dl>"


def _picture(picture: Picture, number: int) -> str:
    """Return a chart inline, its identifiers made unlike those of the other charts."""
    svg = picture.svg[picture.svg.index("<svg") :]
    svg = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>c{number}-", svg)
    # the style of one chart would hold for the whole page; what it says is in the page's style
    svg = re.sub(r"<style\b[^>]*>.*?</style>", "", svg, flags=re.DOTALL)
    label = escape(picture.caption)
    svg = svg.replace("<svg ", f'<svg role="img" aria-label="{label}" ', 1)
    return f"<figure>{svg}<figcaption>{label}</figcaption></figure>"
