"""Which link carries the tool where nobody says so: by usual names, of what joints move."""

import random
from importlib.metadata import distribution
from pathlib import Path

import pytest
from arm_urdfs import load_text

from robots import RobotError, list_robots, load_robot

USUAL = ("tcp", "tool0", "flange", "ee_link")
UR = sorted({info.urdf for info in list_robots() if info.name.startswith("ur")})


def tree(edges):
    """A URDF of (parent, child, whether the joint turns)."""
    names = dict.fromkeys(name for parent, child, _ in edges for name in (parent, child))
    links = "".join(f'<link name="{name}"/>' for name in names)
    joints = "".join(
        f'<joint name="to_{child}" type="{"revolute" if turns else "fixed"}">'
        f'<parent link="{parent}"/><child link="{child}"/><origin xyz="0 0 0.1"/>'
        '<axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>'
        for parent, child, turns in edges
    )
    return f'<robot name="arm">{links}{joints}</robot>'


ARM = [("base_link", "upper", True), ("upper", "wrist", True)]
# As makers write them: the links that nothing hangs on, and the one that is taken.
MADE = {
    "kuka": ([*ARM, ("wrist", "tool0", False), ("base_link", "base", False)], "tool0"),
    "flange before tool": (
        [
            *ARM,
            ("wrist", "flange", False),
            ("flange", "tool0", False),
            ("base_link", "base", False),
        ],
        "tool0",
    ),
    "fingers": (
        [*ARM, ("wrist", "tool0", False), ("tool0", "left", True), ("tool0", "right", True)],
        "tool0",
    ),
    "tcp wins": (
        [*ARM, ("wrist", "ee_link", False), ("wrist", "tool0", False), ("wrist", "tcp", False)],
        "tcp",
    ),
    "one end moves": (
        [*ARM, ("base_link", "base", False), ("base_link", "camera", False)],
        "wrist",
    ),
    "a tool on the table": (
        [*ARM, ("base_link", "tcp", False), ("wrist", "flange", False), ("wrist", "cam", False)],
        "flange",
    ),
}


@pytest.mark.parametrize("name", MADE)
def test_a_urdf_as_it_comes(tmp_path, name):
    edges, expected = MADE[name]
    robot = load_text(tmp_path, tree(edges))
    assert robot.tool_frame == expected
    (note,) = (note for note in robot.notes if note.startswith(f"tool_frame is {expected!r}"))
    beside = {"fingers": ("left", "right")}.get(name, ())
    named = {child for _, child, _ in edges if f"'{child}'" in note.partition(";")[2]}
    assert named == set(beside)  # what no joint moves, or only together with the tool, is no choice
    assert load_text(tmp_path, tree(edges), tool_frame="upper").tool_frame == "upper"


@pytest.mark.parametrize("urdf", UR, ids=lambda path: Path(path).stem)
def test_universal_robots(urdf):
    share = next(f for f in distribution("example-robot-data").files if f.name == "package.xml")
    folder = Path(str(share.locate())).resolve().parent.parent
    robot = load_robot(urdf, package_dirs=folder)
    assert (robot.tool_frame, robot.n) == ("tool0", 6)
    assert any("tool_frame is 'tool0'" in note for note in robot.notes)


def random_tree(rng):
    """A tree of up to ten links, some of them with usual names."""
    count = rng.randint(3, 10)
    names = [f"l{k}" for k in range(count)]
    for name in rng.sample(USUAL, rng.randint(0, 2)):
        names[rng.randrange(1, count)] = name
    return [
        (names[rng.randrange(max(0, k - 3), k)], names[k], rng.random() < 0.5)
        for k in range(1, count)
    ]


def leads_over_a_joint(above, link):
    """Whether a joint turns between the root and a link."""
    while link in above:
        link, turns = above[link]
        if turns:
            return True
    return False


def expected_of(edges):
    """By the definition, link by link: the tool, or None where it has to be asked for."""
    above = {child: (parent, turns) for parent, child, turns in edges}

    def moves(link):
        return leads_over_a_joint(above, link)

    leaves = [child for child in above if child not in {parent for parent, _, _ in edges}]
    if len(leaves) == 1:
        return leaves[0]
    known = [name for name in USUAL if name in above and moves(name)]
    moving = [leaf for leaf in leaves if moves(leaf)]
    return known[0] if known else moving[0] if len(moving) == 1 else None


@pytest.mark.parametrize("seed", range(60))
def test_any_tree(tmp_path, seed):
    edges = random_tree(random.Random(seed))
    expected = expected_of(edges)
    if not any(turns for _, _, turns in edges):
        return
    if expected is None:
        with pytest.raises(RobotError, match="tool_frame must name one"):
            load_text(tmp_path, tree(edges))
        return
    above = {child: (parent, turns) for parent, child, turns in edges}
    if not leads_over_a_joint(above, expected):  # the only leaf, and no joint before it
        with pytest.raises(RobotError, match="no free joint lies between"):
            load_text(tmp_path, tree(edges))
        return
    assert load_text(tmp_path, tree(edges)).tool_frame == expected


def test_the_trees_are_of_all_sorts():
    found = [expected_of(random_tree(random.Random(seed))) for seed in range(60)]
    assert None in found
    assert len([name for name in found if name in USUAL]) >= 8
    assert len([name for name in found if name and name not in USUAL]) >= 8
