"""A comparison of arms as text, JSON, CSV, and as one page."""

from __future__ import annotations

import html
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from feasibility.collisions.words import checked, checked_words
from feasibility.reports.objects_and_csv import MARGINS, csv_text
from feasibility.reports.pages import COLOURS, bar, page, table
from feasibility.reports.text_and_tables import aligned, bodiless, percent
from feasibility.sensitivity.quantities import LEAST_CONE_DEG
from feasibility.studies.robot_comparison import Arm, Comparison
from feasibility.version import version

Column = tuple[str, Callable[[Arm], str]]

COVERED = 2  # column
NOTE = """Bars: share of the area that one continuous motion covers. "Feasible" is said only with a
motion that an independent replay accepted."""


def as_json(comparison: Comparison) -> dict[str, Any]:
    """One object; arms in the order in which they were named."""
    return {
        "case": comparison.case,
        "collisions": checked(comparison.collision),
        "robots": [asdict(arm) for arm in comparison.arms],
        "ranking": [arm.robot for arm in comparison.ranked],
        "version": version(),
    }


def as_csv(comparison: Comparison) -> str:
    """One line for each arm, in the order in which they were named."""
    plain = [name for name in Arm.__dataclass_fields__ if name not in ("margins", "seconds")]
    rows: list[list[Any]] = [[*plain, *(f"margin_{name}" for name in MARGINS), "seconds"]]
    for arm in comparison.arms:
        margins = [(arm.margins or {}).get(name) for name in MARGINS]
        rows.append([*(getattr(arm, name) for name in plain), *margins, round(arm.seconds, 3)])
    return csv_text(rows)


def columns(comparison: Comparison) -> list[Column]:
    """Headings, and the text below each for an arm."""
    cone: list[Column] = [("smallest cone", _smallest_cone)] if comparison.critical else []
    return [
        ("robot", lambda arm: arm.robot),
        ("verdict", lambda arm: arm.verdict),
        ("covered", lambda arm: percent(arm.share)),
        ("motions needed", _patches),
        *cone,
        ("from limits", lambda arm: _unit((arm.margins or {}).get("limit_deg"), "deg")),
        ("inside cone", lambda arm: _unit((arm.margins or {}).get("cone_deg"), "deg")),
        ("reach", lambda arm: "any" if arm.reach_m is None else f"{arm.reach_m:.2f} m"),
        ("joints", lambda arm: str(arm.joints)),
        ("mostly missed for", lambda arm: (arm.cause or "-").replace("_", " ")),
    ]


def _smallest_cone(arm: Arm) -> str:
    """'12.5 deg', or '<= 0.5 deg': cones narrower than `LEAST_CONE_DEG` are not tried."""
    cone = arm.critical_cone_deg
    least = cone is not None and cone <= LEAST_CONE_DEG
    return f"{'<= ' if least else ''}{_unit(cone, 'deg')}"


def _patches(arm: Arm) -> str:
    """How many motions, and the share that they cover if not all."""
    if arm.patches is None or arm.patches_share is None:
        return "-"
    if arm.patches == 0:
        return "none covers a cell"
    everything = arm.patches_share > 1.0 - 1e-9
    return str(arm.patches) if everything else f"{arm.patches} for {percent(arm.patches_share)}"


def _unit(value: float | None, unit: str) -> str:
    """A number with its unit."""
    return "-" if value is None else f"{value:.1f} {unit}"


def as_text(comparison: Comparison) -> str:
    """The table for people, the best arm first."""
    heads = columns(comparison)
    rows = [[head for head, _ in heads]]
    rows += [[text(arm) for _, text in heads] for arm in comparison.ranked]
    rules = ["-" * max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [line.rstrip() for line in aligned([rows[0], rules, *rows[1:]])]
    return "\n".join([headline(comparison), f"  {_said(comparison)}", "", *lines])


def _said(comparison: Comparison) -> str:
    """What is said of collisions."""
    unchecked = bodiless(arm.unchecked_links for arm in comparison.arms)
    return checked_words(comparison.collision) + unchecked


def headline(comparison: Comparison) -> str:
    """The result in one sentence."""
    able = [arm.robot for arm in comparison.ranked if arm.verdict == "feasible"]
    number = len(comparison.arms)
    name = comparison.case
    if not able:
        best = comparison.ranked[0]
        most = f"{best.robot} covers most, {percent(best.share)} of the area"
        return f"{name}: none of {number} robots covers the whole surface in one motion; {most}"
    cover = f"cover{'s' if len(able) == 1 else ''} the whole surface in one motion"
    return f"{name}: {len(able)} of {number} robots {cover}: {', '.join(able)}"


def as_html(comparison: Comparison) -> str:
    """One self-contained page: headline, and the table with bars of the covered share."""
    heads, lines = columns(comparison), []
    for arm in comparison.ranked:
        cells = [html.escape(text(arm)) for _, text in heads]
        cells[COVERED] += bar((arm.share, COLOURS[arm.verdict], arm.message))
        lines.append(cells)
    body = f"<p>{html.escape(headline(comparison))}.</p>\n"
    body += table((html.escape(name) for name, _ in heads), lines)
    return page(f"Robots compared: {comparison.case}", body, NOTE, _said(comparison))
