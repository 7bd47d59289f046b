"""Make the figures of the pages, Figs. 2 to 5 of the paper among them: `python docs/figures.py`.

They are drawn by the public functions that users have, without a browser, into `docs/figures/`.
"""

from __future__ import annotations

from pathlib import Path

from coverable import (
    builtin_cases,
    check,
    greedy_check,
    plot_causes,
    plot_graph,
    plot_transition,
    plot_views,
    view,
)

FOLDER = Path(__file__).parent / "figures"
FIGURES = {  # the paper's, and the cases that they are of
    "fig-4": ("4a", "4b", "4c", "4d", "4e", "4f"),
    "fig-5": ("5a", "5b", "5c", "5d", "5e", "5f"),
}


def main() -> None:
    """Make all of them."""
    FOLDER.mkdir(exist_ok=True)
    cases = {name.removeprefix("paper/"): case for name, case in builtin_cases().items()}
    verdicts = {name: check(*case.build()) for name, case in cases.items()}
    greedy = {name: greedy_check(*cases[name].build()[:3]) for name in ("4a", "4d")}
    figures = {
        "causes": plot_causes(verdicts["4d"]),
        "fig-2": plot_transition(greedy["4a"]),
        "fig-3": plot_graph(greedy["4a"]),
        "missed": plot_graph(greedy["4d"]),
    }
    for name, shown in FIGURES.items():
        views = {case: view(verdicts[case], case, play=False) for case in shown}
        figures[name] = plot_views(views, columns=3)
    for name, figure in figures.items():
        figure.savefig(FOLDER / f"{name}.png", dpi=110)


if __name__ == "__main__":
    main()
