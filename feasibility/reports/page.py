"""Parts of self-contained pages: the frame, tables, and the colours of verdicts."""

from __future__ import annotations

import html
from collections.abc import Iterable

from feasibility.version import version

# Colours that most colour-blind people can tell apart.
COLOURS = {"feasible": "#1b7f5c", "infeasible": "#c05621", "undecided": "#6b7280"}


def page(title: str, body: str, note: str) -> str:
    """One page that fetches nothing.

    Args:
        title: plain text.
        body: HTML.
        note: plain text at the end; the program's version follows.
    """
    return _PAGE.format(
        title=html.escape(title), body=body, note=html.escape(f"{note} coverable {version()}")
    )


def table(heads: Iterable[str], lines: Iterable[Iterable[str]]) -> str:
    """A table of escaped cells, as HTML."""
    head = "".join(f"<th>{cell}</th>" for cell in heads)
    body = "".join(
        "<tr>" + "".join(f"<td>{cell}</td>" for cell in line) + "</tr>\n" for line in lines
    )
    return f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n</table>\n"


_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
body {{ font: 15px/1.45 system-ui, sans-serif; margin: 2.5rem auto; max-width: 66rem;
  padding: 0 1rem; color: #1f2937; background: #fff; }}
h1 {{ font-size: 1.35rem; margin-bottom: .3rem; overflow-wrap: anywhere; }}
h2 {{ font-size: 1.05rem; margin: 1.8rem 0 .4rem; overflow-wrap: anywhere; }}
p {{ overflow-wrap: anywhere; }}
table {{ border-collapse: collapse; margin-top: .4rem; width: 100%; }}
th, td {{ text-align: left; padding: .3rem .8rem .3rem 0; border-bottom: 1px solid #e5e7eb;
  overflow-wrap: anywhere; }}
td {{ font-variant-numeric: tabular-nums; }}
svg {{ max-width: 100%; height: auto; }}
svg.bars text {{ font: 13px system-ui, sans-serif; fill: #1f2937; }}
svg.bars text.tick {{ font-size: 11px; fill: #6b7280; }}
.charts {{ display: flex; flex-wrap: wrap; gap: 1rem; }}
figure {{ margin: 0; flex: 1 1 26rem; }}
figcaption {{ color: #4b5563; font-size: .85rem; overflow-wrap: anywhere; }}
.keys span {{ margin-right: 1.2rem; }}
.keys i {{ display: inline-block; width: .8rem; height: .8rem; border-radius: 2px;
  margin-right: .35rem; }}
.bar {{ display: block; width: 9rem; height: .7rem; background: #eef0f3; }}
.bar b {{ display: block; height: 100%; background: #4b7fb3; }}
iframe {{ width: 100%; height: 620px; border: 1px solid #e5e7eb; }}
footer {{ margin-top: 1.8rem; color: #6b7280; font-size: .85rem; }}
@media print {{ h2, table, figure {{ break-inside: avoid; }} }}
</style>
</head>
<body>
<h1>{title}</h1>
{body}<footer>{note}</footer>
</body>
</html>
"""
