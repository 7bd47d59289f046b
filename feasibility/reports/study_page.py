"""A study as one self-contained page: what came of it, by value, the best rows, charts, poses."""

from __future__ import annotations

import html
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from feasibility.reports.comparison import COLOURS
from feasibility.reports.study import (
    BEST,
    best_share,
    counted,
    counts,
    dominant,
    group_table,
    groups_of,
    headline,
    merit,
    share_text,
    short,
)
from feasibility.reports.study_plot import charts, worded
from feasibility.version import version

if TYPE_CHECKING:
    from feasibility.studies import Row, Study
    from feasibility.viewer import View

BAR = 640  # px


def as_html(study: Study, rows: Sequence[Row], drawn: View | None = None) -> str:
    """One page that fetches nothing.

    Args:
        study: what was asked.
        rows: what came of it.
        drawn: the poses of the surface, where they vary; see `placement_view.view_study`.
    """
    failed = [row for row in rows if row.status == "failed"]
    parts = [_verdicts(rows), _causes(rows)]
    if failed:
        words = f"{len(failed)} failed; the first: {failed[0].result['message']}"
        parts.append(f"<p>{html.escape(words)}</p>\n")
    parts.append(_best(study, rows))
    parts += [_by_value(label, groups) for label, groups in groups_of(study, rows).items()]
    pictures = charts(study.labels, rows)
    figures = [
        f"<figure>{chart.svg}<figcaption>{html.escape(chart.caption)}</figcaption></figure>\n"
        for chart in pictures.drawn
    ]
    if figures:
        parts.append(f'<h2>Covered share</h2>\n<div class="charts">{"".join(figures)}</div>\n')
    if pictures.left_out:
        parts.append(f"<p>Pairs of numbers without a map: {pictures.left_out}.</p>\n")
    if drawn is not None:
        page = html.escape(drawn.html(), quote=True)
        parts.append(f'<h2>Poses</h2>\n<iframe srcdoc="{page}" loading="lazy"></iframe>\n')
    return _PAGE.format(
        title=html.escape(f"Study: {study.name}"),
        description=f"<p>{html.escape(study.description)}</p>" if study.description else "",
        headline=html.escape(headline(study, rows)),
        body="".join(parts),
        version=html.escape(version()),
    )


def _verdicts(rows: Sequence[Row]) -> str:
    """How many cases have each verdict, as one bar."""
    shares, x = [], 0.0
    for verdict, number in counts(rows).items():
        width = BAR * number / max(len(rows), 1)
        if number:
            shares.append(
                f'<rect x="{x:.2f}" y="0" width="{width:.2f}" height="22" '
                f'fill="{COLOURS[verdict]}"><title>{number} {verdict}</title></rect>'
            )
        x += width
    keys = "".join(
        f'<span><i style="background: {COLOURS[verdict]}"></i>{number} {verdict}</span>'
        for verdict, number in counts(rows).items()
        if number
    )
    return (
        f'<svg role="img" aria-label="{html.escape(counted(counts(rows)))}" '
        f'viewBox="0 0 {BAR} 22" width="{BAR}" height="22">{"".join(shares)}</svg>\n'
        f'<p class="keys">{keys}</p>\n'
    )


def _causes(rows: Sequence[Row]) -> str:
    """Why cells are missed, mostly: how many cases for each cause."""
    causes = Counter(cause for row in rows if (cause := dominant(row)))
    if not causes:
        return ""
    lines = [
        [cause.replace("_", " "), str(number), _bar(number / len(rows))]
        for cause, number in causes.most_common()
    ]
    return "<h2>Why cells are missed</h2>\n" + _table(
        ["most of the missed cells", "cases", ""], [[*map(html.escape, a), b] for *a, b in lines]
    )


def _best(study: Study, rows: Sequence[Row]) -> str:
    """The best rows, and what varies there."""
    lines = []
    for row in sorted(rows, key=merit)[:BEST]:
        limit = (row.result.get("margins") or {}).get("limit_deg")
        cells = [str(row.result["verdict"]), share_text(row)]
        cells.append("-" if limit is None else f"{limit:.1f} deg")
        cells += [short(row.parameters[label]) for label in study.labels]
        lines.append([html.escape(cell) for cell in cells])
    heads = ["verdict", "covered", "from limits", *map(worded, study.labels)]
    return f"<h2>The best of {len(rows)}</h2>\n" + _table(map(html.escape, heads), lines)


def _by_value(label: str, groups: dict[str, list[Row]]) -> str:
    """One line for each value of a key."""
    (_, *heads), *lines = group_table(label, groups)
    bars = [_bar(best_share(group) or 0.0) for group in groups.values()]
    filled = [[*map(html.escape, line), bar] for line, bar in zip(lines, bars, strict=True)]
    name = html.escape(worded(label))
    return f"<h2>By {name}</h2>\n" + _table([name, *heads, ""], filled)


def _bar(share: float) -> str:
    """A share of 1 as a bar."""
    return (
        f'<span class="bar"><b style="width: {100.0 * min(max(share, 0.0), 1.0):.1f}%"></b></span>'
    )


def _table(heads: Iterable[str], lines: Sequence[Sequence[str]]) -> str:
    """A table of escaped cells."""
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
table {{ border-collapse: collapse; width: 100%; }}
th, td {{ text-align: left; padding: .3rem .8rem .3rem 0; border-bottom: 1px solid #e5e7eb;
  overflow-wrap: anywhere; }}
td {{ font-variant-numeric: tabular-nums; }}
svg {{ max-width: 100%; height: auto; }}
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
{description}
<p>{headline}</p>
{body}<footer>Share: of the area, in one continuous motion. "Feasible" is said only with a motion
that an independent replay accepted. coverable {version}</footer>
</body>
</html>
"""
