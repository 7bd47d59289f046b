"""Motion files: columns by name, in any order, with units; every fault is named with its place."""

from __future__ import annotations

import numpy as np
import pytest
from arm_builds import bare, on_a_base
from arm_urdfs import load_text

from feasibility.results import load_motion
from feasibility.safe_files import FileError
from robots import load_robot

ROWS = np.array([[0.1, -1.2, 1.3, -0.4, -1.5, 0.6], [0.2, -1.1, 1.2, -0.3, -1.4, 0.7]])
NAMES = load_robot("puma560").joint_names


def text_of(names=NAMES, rows=ROWS, separator=","):
    lines = [separator.join(names), *(separator.join(map(repr, row)) for row in rows.tolist())]
    return "\n".join(lines) + "\n"


@pytest.fixture
def read(tmp_path):
    """Read a text as a motion of the PUMA."""

    def reading(text, robot=None):
        path = tmp_path / "motion.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return load_motion(path, load_robot("puma560") if robot is None else robot)

    return reading


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_columns_go_by_name(read, separator):
    order = [3, 0, 5, 1, 4, 2]
    shuffled = text_of([NAMES[k] for k in order], ROWS[:, order], separator)
    assert np.array_equal(read(shuffled).q, ROWS)
    assert read(shuffled).notes == ()


def test_degrees_by_their_columns_name(read):
    names = [f"{name}_deg" if k in (1, 4) else name for k, name in enumerate(NAMES)]
    rows = ROWS.copy()
    rows[:, [1, 4]] = np.degrees(rows[:, [1, 4]])
    np.testing.assert_allclose(read(text_of(names, rows)).q, ROWS, atol=1e-15)


def test_other_columns_are_left_aside_or_refused(read):
    extra = np.column_stack([np.arange(2.0), ROWS, np.zeros(2), [4.0, 5.0]])
    found = read(text_of(["time", *NAMES, f"{NAMES[0]}_velocity", "cell"], extra))
    assert np.array_equal(found.q, ROWS)
    assert found.notes == (f"not used: time, {NAMES[0]}_velocity, cell",)
    with pytest.raises(FileError, match=r"line 1: column 'gripper' is no joint of puma560"):
        read(text_of(["gripper", *NAMES], extra[:, :7]))


def test_small_things_that_files_have(read):
    with_mark = b"\xef\xbb\xbf" + text_of().replace("\n", "\r\n").encode()
    assert np.array_equal(read(with_mark).q, ROWS)
    assert np.array_equal(read(text_of().replace(",", " , ") + "\n\n").q, ROWS)


def test_wrapped_values_are_noted(read):
    rows = np.vstack([ROWS, ROWS[-1:]])
    rows[2, 5] -= 2 * np.pi
    found = read(text_of(rows=rows))
    assert found.notes == (
        "joint6 moves by more than half a turn from row 2 to 3; values must be unwrapped",
    )


FAULTS = {
    "empty": ("", "is empty"),
    "no rows": (",".join(NAMES), "has no rows"),
    "no head": ("1,2,3,4,5,6\n", "begins with numbers; expected a first line of joint names"),
    "one short": (text_of(NAMES[:5], ROWS[:, :5]), f"joint {NAMES[5]} has no column"),
    "one twice": (
        text_of([*NAMES[:5], NAMES[0]]),
        f"joint {NAMES[0]} has 2 columns",
    ),
    "in both units": (
        text_of([*NAMES[:5], f"{NAMES[0]}_deg"]),
        f"joint {NAMES[0]} has 2 columns",
    ),
    "misspelt": (text_of(["jiont1", *NAMES[1:]]), 'did you mean "joint1"?'),
    "ragged": (text_of() + "1,2,3\n", "line 4: has 3 fields, not the 6"),
    "not a number": (text_of().replace("1.3", "NaN"), "line 2: joint3 is 'NaN', no finite number"),
    "infinite": (text_of().replace("1.3", "-inf"), "no finite number"),
    "a word": (text_of().replace("1.3", "open"), "line 2: joint3 is 'open', no finite number"),
    "nothing": (text_of().replace("1.3", ""), "line 2: joint3 is '', no finite number"),
    "degrees": (text_of(rows=np.degrees(ROWS)), "holds degrees, it seems: joint"),
    "no text": (b"\xff\xfe\x00\x01", "is not text"),
    "a quote": (text_of() + '"1,2\n', "is not CSV"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faults(read, name):
    text, word = FAULTS[name]
    with pytest.raises(FileError) as caught:
        read(text)
    assert word in str(caught.value), caught.value
    assert "motion.csv" in str(caught.value)


def test_all_faults_are_named_at_once(read):
    bad = text_of().replace("1.3", "x").replace("1.2,", "y,")
    with pytest.raises(FileError) as caught:
        read(bad)
    assert len(caught.value.faults) >= 2


def test_millimetres_on_a_rail(tmp_path, read):
    from xml.etree import ElementTree as ET

    tree = on_a_base(bare(load_robot("ur5").urdf), "prismatic", limits=(0.0, 2.0))
    robot = load_text(tmp_path, ET.tostring(tree, encoding="unicode"), tool_frame="tool0")
    rows = np.column_stack([[0.5, 0.6], ROWS])
    assert np.array_equal(read(text_of(robot.joint_names, rows), robot).q, rows)
    rows[:, 0] *= 1e3
    with pytest.raises(FileError, match="holds millimetres, it seems: test_joint is 600 where"):
        read(text_of(robot.joint_names, rows), robot)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(FileError, match="there is no such file; expected a joint motion"):
        load_motion(tmp_path / "none.csv", load_robot("puma560"))
