"""A report as Markdown, and as one HTML page that opens anywhere, with nothing else beside it."""

from __future__ import annotations

import base64
import html
import importlib.resources
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from planners.bench.markdown import table

__all__ = ["Picture", "Section", "Table", "html_page", "markdown_page"]


@dataclass(frozen=True, kw_only=True)
class Table:
    """Hold a table. `**` around words makes them bold.

    Parameters
    ----------
    head : sequence of str
        Of the columns.
    rows : sequence of sequence of str
        As many cells each as there are columns.
    title : str
        Says in one line what the table shows.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""


@dataclass(frozen=True, kw_only=True)
class Picture:
    """Hold a picture that stands beside the report.

    Parameters
    ----------
    name : str
        Of the file (.png), in the folder of the report.
    text : str
        Says what there is to see: for those who cannot, too.
    """

    name: str
    text: str


@dataclass(frozen=True, kw_only=True)
class Section:
    """Hold a part of a report.

    Parameters
    ----------
    title : str
        Its heading.
    text : sequence of str
        Paragraphs, before tables and pictures.
    blocks : sequence of Table or Picture
        In their order.
    """

    title: str
    text: Sequence[str] = ()
    blocks: Sequence[Table | Picture] = ()


def markdown_page(title: str, sections: Sequence[Section]) -> str:
    """Write a report as Markdown; its pictures are links to the files."""
    lines = [f"# {title}"]
    for section in sections:
        lines += ["", f"## {section.title}"]
        for paragraph in section.text:
            lines += ["", paragraph]
        for block in section.blocks:
            lines += ["", *_markdown_block(block)]
    return "\n".join(lines) + "\n"


def _markdown_block(block: Table | Picture) -> Iterator[str]:
    if isinstance(block, Picture):
        yield f"![{block.text}]({block.name})"
        return
    if block.title:
        yield f"**{block.title}**"
        yield ""
    escaped = [[cell.replace("|", "\\|") for cell in row] for row in (block.head, *block.rows)]
    yield from table(escaped[0], escaped[1:])


def html_page(title: str, sections: Sequence[Section], pictures: Mapping[str, bytes]) -> str:
    """Write a report as one self-contained page.

    Parameters
    ----------
    title : str
        Of the page.
    sections : sequence of Section
        In their order.
    pictures : mapping
        Contents of the files by their names.
    """
    parts = {
        "TITLE": html.escape(title),
        "CONTENTS": "".join(
            f'<a href="#part{number}">{html.escape(section.title)}</a>'
            for number, section in enumerate(sections)
        ),
        "BODY": "\n".join(
            _html_section(number, section, pictures) for number, section in enumerate(sections)
        ),
    }
    template = importlib.resources.files("planners.bench").joinpath("report.html").read_text(encoding="utf-8")
    # In one go, so that nothing in a cell is taken for a place to fill.
    return re.sub("__(TITLE|CONTENTS|BODY)__", lambda place: parts[place[1]], template)


def _html_section(number: int, section: Section, pictures: Mapping[str, bytes]) -> str:
    paragraphs = "".join(f"<p>{_inline(paragraph)}</p>" for paragraph in section.text)
    blocks = "\n".join(
        _html_picture(block, pictures[block.name]) if isinstance(block, Picture) else _html_table(block)
        for block in section.blocks
    )
    return f'<section id="part{number}"><h2>{html.escape(section.title)}</h2>{paragraphs}\n{blocks}</section>'


def _html_picture(picture: Picture, data: bytes) -> str:
    source = base64.b64encode(data).decode("ascii")
    text = html.escape(picture.text)
    return (
        f'<figure><img src="data:image/png;base64,{source}" alt="{text}">'
        f"<figcaption>{text}</figcaption></figure>"
    )


def _html_table(block: Table) -> str:
    head = "".join(f'<th scope="col">{_inline(cell)}</th>' for cell in block.head)
    rows = "".join(
        f'<tr><th scope="row">{_inline(row[0])}</th>'
        + "".join(f"<td>{_inline(cell)}</td>" for cell in row[1:])
        + "</tr>\n"
        for row in block.rows
    )
    title = f"<h3>{_inline(block.title)}</h3>" if block.title else ""
    label = html.escape(re.sub(r"\*\*", "", block.title)) or "Table"
    return (
        f'{title}<div class="scroll" tabindex="0" role="region" aria-label="{label}">'
        f"<table><thead><tr>{head}</tr></thead>\n<tbody>{rows}</tbody></table></div>"
    )


def _inline(text: str) -> str:
    """Write text as HTML: words between `**` bold, those between backquotes as code."""
    bold = re.sub(r"\*\*(.+?)\*\*", r"<strong>\1</strong>", html.escape(text))
    return re.sub(r"`(.+?)`", r"<code>\1</code>", bold)
