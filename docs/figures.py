"""Make the figures of the pages, Figs. 2 to 5 of the paper among them: `python docs/figures.py`.

They are drawn by the public functions that users have, without a browser, into `docs/figures/`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coverable import (
    Plot,
    Robot,
    builtin_cases,
    check,
    greedy_check,
    list_robots,
    load_robot,
    plot_causes,
    plot_graph,
    plot_transition,
    plot_views,
    view,
)
from coverable.arrays import Array
from feasibility.viewer.painter import painted
from feasibility.viewer.robot_visuals import draw, home, pose
from feasibility.viewer.stage import framing, joint_points

FOLDER = Path(__file__).parent / "figures"
FROM = np.array([0.9, -1.4, 0.6])  # where arms are seen from
FIGURES = {  # the paper's, and the cases that they are of
    "fig-4": ("4a", "4b", "4c", "4d", "4e", "4f"),
    "fig-5": ("5a", "5b", "5c", "5d", "5e", "5f"),
}


def arms(groups: tuple[str, ...], columns: int) -> Plot:
    """The arms of the library that are here, each below its name."""
    names = [info.name for info in list_robots() if info.group in groups]
    rows = -(-len(names) // columns)
    figure = Plot(figsize=(1.6 * columns, 1.75 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, name in zip(grid.flat, names, strict=False):
        axes.imshow(picture(load_robot(name)), interpolation="lanczos")
        axes.set_title(name, fontsize=8)
    return figure


def picture(robot: Robot, side: int = 260) -> Array:
    """(side, side, 3) an arm with its second and third joint bent."""
    q = home(robot)
    q[1:3] += (-0.5, 0.8)
    q = np.clip(q, robot.lower, robot.upper)
    points = np.vstack([np.zeros((1, 3)), joint_points(robot, q)])
    commands = (*draw(robot).commands, *pose(robot, q))
    return painted(commands, framing(points, FROM / np.linalg.norm(FROM), 1.5), side, side)


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
        "arms": arms(("manipulator", "industrial"), columns=7),
        "arms-of-robots": arms(("humanoid", "legged"), columns=6),
    }
    for name, shown in FIGURES.items():
        views = {case: view(verdicts[case], case, play=False) for case in shown}
        figures[name] = plot_views(views, columns=3)
    for name, figure in figures.items():
        figure.savefig(FOLDER / f"{name}.png", dpi=110)


if __name__ == "__main__":
    main()
