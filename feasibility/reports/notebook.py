"""A verdict as a notebook shows it: the figures, why cells are missed, and the picture."""

from __future__ import annotations

import base64
import html
from collections import Counter

from coverable.errors import counted
from feasibility.collisions.asked_bodies import said_of
from feasibility.reports.pages import table
from feasibility.reports.shortfalls import CAUSES
from feasibility.reports.verdict import SENTENCES, rows_of
from feasibility.verdict import Verdict
from feasibility.viewer.viewer import view


def mimebundle(verdict: Verdict) -> dict[str, str]:
    """What Jupyter asks for: text, a page for a notebook that is trusted, a picture for others.

    Args:
        verdict: of either method.
    """
    picture = base64.b64encode(view(verdict, play=False).png()).decode("ascii")
    return {
        "text/plain": repr(verdict),
        "text/html": _page(verdict, picture),
        "image/png": picture,
    }


def _page(verdict: Verdict, picture: str) -> str:
    """Table and picture side by side."""
    rows = [(name, html.escape(text)) for name, text in rows_of(verdict) if text]
    causes = Counter((cause.kind, cause.proved) for cause in verdict.causes)
    for (kind, proved), number in causes.most_common():
        text = f"{counted(number, 'cell')}: {CAUSES[kind]}{', proved' if proved else ''}"
        rows.append(("not covered", html.escape(text)))
    rows.append(("note", html.escape(said_of(verdict.robot, verdict.task.collision))))
    body = table(("", html.escape(SENTENCES[verdict.answer])), rows)
    for cell in ("<th>", "<td>"):  # Jupyter's own style is for numbers
        body = body.replace(cell, f'{cell[:-1]} style="text-align: left">')
    return (
        '<div style="display: flex; flex-wrap: wrap; gap: 1rem; align-items: flex-start">'
        f'<div style="flex: 1 1 24rem">{body}</div>'
        f'<img src="data:image/png;base64,{picture}" alt="the arm and the surface" '
        'style="flex: 1 1 24rem; max-width: 36rem; min-width: 0"></div>'
    )
