"""A comparison of arms as text, JSON, CSV, and as one page with a table and a chart."""

from __future__ import annotations

import csv
import html
import io
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from feasibility.sensitivity import LEAST_CONE_DEG
from feasibility.studies import Arm, Comparison
from feasibility.version import version

Column = tuple[str, Callable[[Arm], str]]

# Colours that stay apart for most colour-blind people.
COLOURS = {"feasible": "#1b7f5c", "infeasible": "#c05621", "undecided": "#6b7280"}
ROW, BAR, LABEL = 30, 460, 130  # px: height of a row, length of a full bar, room for names


def as_json(comparison: Comparison) -> dict[str, Any]:
    """One object; arms in the order in which they were named."""
    return {
        "case": comparison.case,
        "robots": [asdict(arm) for arm in comparison.arms],
        "ranking": [arm.robot for arm in comparison.ranked],
        "version": version(),
    }


def as_csv(comparison: Comparison) -> str:
    """One line for each arm, in the order in which they were named."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    plain = [name for name in Arm.__dataclass_fields__ if name not in ("margins", "seconds")]
    margins = ("limit_deg", "limit_m", "cone_deg", "reach_m")
    table.writerow([*plain, *(f"margin_{name}" for name in margins), "seconds"])
    for arm in comparison.arms:
        values = [getattr(arm, name) for name in plain]
        values += [(arm.margins or {}).get(name) for name in margins]
        table.writerow(["" if v is None else v for v in [*values, round(arm.seconds, 3)]])
    return text.getvalue()


def columns(comparison: Comparison) -> list[Column]:
    """Headings, and what each says of an arm."""
    found: list[Column] = [
        ("robot", lambda arm: arm.robot),
        ("verdict", lambda arm: arm.verdict),
        ("covered", lambda arm: f"{100.0 * arm.share:.1f} %"),
    ]
    if comparison.divided:
        found.append(("motions needed", _patches))
    if comparison.critical:
        found.append(("smallest cone", _smallest_cone))
    return [
        *found,
        ("from limits", lambda arm: _unit((arm.margins or {}).get("limit_deg"), "deg")),
        ("inside cone", lambda arm: _unit((arm.margins or {}).get("cone_deg"), "deg")),
        ("reach", lambda arm: "any" if arm.reach_m is None else f"{arm.reach_m:.2f} m"),
        ("joints", lambda arm: str(arm.joints)),
        ("mostly missed for", lambda arm: (arm.cause or "-").replace("_", " ")),
    ]


def _smallest_cone(arm: Arm) -> str:
    """'12.5 deg'; narrower ones than some are not looked at."""
    cone = arm.critical_cone_deg
    few = cone is not None and cone <= LEAST_CONE_DEG
    return f"{'<= ' if few else ''}{_unit(cone, 'deg')}"


def _patches(arm: Arm) -> str:
    """How many motions, and what they leave."""
    if arm.patches is None or arm.patches_share is None:
        return "-"
    if arm.patches == 0:
        return "none helps"
    whole = arm.patches_share > 1.0 - 1e-9
    return str(arm.patches) if whole else f"{arm.patches} for {100.0 * arm.patches_share:.1f} %"


def _unit(value: float | None, unit: str) -> str:
    """A number with its unit."""
    return "-" if value is None else f"{value:.1f} {unit}"


def as_text(comparison: Comparison) -> str:
    """The table for people, the best arm first."""
    heads = columns(comparison)
    rows = [[head for head, _ in heads]]
    rows += [[say(arm) for _, say in heads] for arm in comparison.ranked]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    lines.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join([headline(comparison), "", *lines])


def headline(comparison: Comparison) -> str:
    """What a person would say of it."""
    able = [arm.robot for arm in comparison.ranked if arm.verdict == "feasible"]
    number = len(comparison.arms)
    name = comparison.case
    if not able:
        best = comparison.ranked[0]
        return (
            f"{name}: none of {number} robots covers the whole surface in one motion; {best.robot} "
            f"covers most, {100.0 * best.share:.1f} % of the area"
        )
    which = ", ".join(able)
    cover = "covers" if len(able) == 1 else "cover"
    return (
        f"{name}: {len(able)} of {number} robots {cover} the whole surface in one motion: {which}"
    )


def as_html(comparison: Comparison) -> str:
    """One self-contained page: headline, bars of the covered share, table."""
    heads = columns(comparison)
    head = "".join(f"<th>{html.escape(name)}</th>" for name, _ in heads)
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(say(arm))}</td>" for _, say in heads) + "</tr>\n"
        for arm in comparison.ranked
    )
    return _PAGE.format(
        title=html.escape(f"Robots compared: {comparison.case}"),
        headline=html.escape(headline(comparison)),
        chart=chart(comparison),
        head=head,
        body=body,
        version=html.escape(version()),
    )


def chart(comparison: Comparison) -> str:
    """The covered share of each arm as bars, an SVG element."""
    arms = comparison.ranked
    height = ROW * len(arms) + 26
    width = LABEL + BAR + 90
    parts = [
        f'<svg role="img" aria-label="covered share of the area by robot" '
        f'viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
    ]
    for percent in (0, 25, 50, 75, 100):
        x = LABEL + BAR * percent / 100
        parts.append(
            f'<line x1="{x:g}" y1="0" x2="{x:g}" y2="{ROW * len(arms)}" stroke="#d1d5db"/>'
            f'<text x="{x:g}" y="{height - 8}" text-anchor="middle" class="tick">{percent} %</text>'
        )
    for k, arm in enumerate(arms):
        top, length = ROW * k + 5, max(BAR * arm.share, 0.0)
        parts.append(
            f'<text x="{LABEL - 8}" y="{top + 14}" text-anchor="end">{html.escape(arm.robot)}'
            f'</text><rect x="{LABEL}" y="{top}" width="{length:.2f}" height="{ROW - 10}" '
            f'fill="{COLOURS[arm.verdict]}"><title>{html.escape(arm.message)}</title></rect>'
            f'<text x="{LABEL + length + 6:.2f}" y="{top + 14}">{100.0 * arm.share:.1f} %</text>'
        )
    return "".join([*parts, "</svg>"])


_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
body {{ font: 15px/1.45 system-ui, sans-serif; margin: 2.5rem auto; max-width: 62rem;
  padding: 0 1rem; color: #1f2937; background: #fff; }}
h1 {{ font-size: 1.35rem; margin-bottom: .3rem; }}
table {{ border-collapse: collapse; margin-top: 1.5rem; width: 100%; }}
th, td {{ text-align: left; padding: .35rem .7rem .35rem 0; border-bottom: 1px solid #e5e7eb; }}
td {{ font-variant-numeric: tabular-nums; }}
svg {{ max-width: 100%; height: auto; margin-top: 1rem; }}
svg text {{ font: 13px system-ui, sans-serif; fill: #1f2937; }}
svg text.tick {{ font-size: 11px; fill: #6b7280; }}
footer {{ margin-top: 1.5rem; color: #6b7280; font-size: .85rem; }}
</style>
</head>
<body>
<h1>{title}</h1>
<p>{headline}.</p>
{chart}
<table>
<thead><tr>{head}</tr></thead>
<tbody>
{body}</tbody>
</table>
<footer>Bars: share of the area that one continuous motion covers. "Feasible" is said only with a
motion that an independent replay accepted. coverable {version}</footer>
</body>
</html>
"""
