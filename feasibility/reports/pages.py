"""Pages of answers: title, tables and views in one file that fetches nothing."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from feasibility.collisions.words import Asked, checked_words
from feasibility.version import version

if TYPE_CHECKING:
    from feasibility.viewer.viewer import View

FILE = Path(__file__).with_name("page") / "report.html"
# Colours that most colour-blind people can tell apart.
COLOURS = {"feasible": "#1b7f5c", "infeasible": "#c05621", "undecided": "#6b7280"}
PLAIN = "#4b7fb3"


def page(title: str, body: str, note: str, collision: Asked | str | None) -> str:
    """One page that fetches nothing.

    Args:
        title: plain text.
        body: HTML.
        note: plain text at the end; the program's version follows.
        collision: what was checked, or a sentence about it.
    """
    checked = collision if isinstance(collision, str) else checked_words(collision)
    template = FILE.read_text(encoding="utf-8")
    return Template(template).substitute(
        title=html.escape(title),
        unchecked=html.escape(checked),
        body=body,
        note=html.escape(f"{note} coverable {version()}"),
    )


def framed(view: View, title: str) -> str:
    """A view as HTML: its page in a frame, and its picture on paper, where the frame is empty."""
    inner, name = html.escape(view.html(), quote=True), html.escape(title, quote=True)
    picture = base64.b64encode(view.png()).decode("ascii")
    return (
        f'<iframe srcdoc="{inner}" title="{name}" loading="lazy"></iframe>\n'
        f'<img class="printed" src="data:image/png;base64,{picture}" alt="{name}">\n'
    )


def bar(*parts: tuple[float, str, str]) -> str:
    """Shares of 1 in one bar, each with its colour, and a text where the mouse is."""
    inner = "".join(
        f'<b style="width: {100.0 * min(max(share, 0.0), 1.0):.1f}%; background: {colour}" '
        f'title="{html.escape(text, quote=True)}"></b>'
        for share, colour, text in parts
    )
    return f'<span class="bar">{inner}</span>'


def table(heads: Iterable[str], lines: Iterable[Iterable[str]]) -> str:
    """A table of escaped cells, as HTML."""
    head = "".join(f"<th>{cell}</th>" for cell in heads)
    body = "".join(
        "<tr>" + "".join(f"<td>{cell}</td>" for cell in line) + "</tr>\n" for line in lines
    )
    return f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n</table>\n"
