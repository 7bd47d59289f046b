"""SRDF files: what is taken of them, and what is refused."""

import pytest

from robots.urdf import UrdfError, read_srdf


def srdf(folder, inside, name="arm.srdf"):
    path = folder / name
    path.write_text(f'<?xml version="1.0"?>\n<robot name="arm">\n{inside}\n</robot>')
    return path


def test_only_pairs_with_a_stated_reason_are_taken(tmp_path):
    reasons = ("Adjacent", "Default", "Always", "User", "Never", "never", "", "Because")
    lines = [
        f'<disable_collisions link1="a" link2="b{k}" reason="{reason}"/>'
        for k, reason in enumerate(reasons)
    ]
    lines += [
        '<disable_collisions link1="c" link2="d"/>',
        '<group name="arm"><joint name="j"/></group>',
    ]
    pairs = read_srdf(srdf(tmp_path, "\n".join([*lines, lines[0]])))
    assert pairs.taken == (("a", "b0"), ("a", "b1"), ("a", "b2"), ("a", "b3"))
    assert dict(pairs.ignored) == {"Never": 1, "never": 1, "": 2, "Because": 1}
    assert pairs.named == {"a", "c", "d", *(f"b{k}" for k in range(8))}


def test_a_xacro_file_is_expanded(tmp_path):
    inside = (
        '<xacro:macro name="pair" params="k">'
        '<disable_collisions link1="a" link2="b${k}" reason="Adjacent"/></xacro:macro>'
        '<xacro:pair k="1"/><xacro:pair k="2"/>'
    )
    path = srdf(tmp_path, inside, "arm.srdf.xacro")
    path.write_text(
        path.read_text().replace("<robot", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"')
    )
    assert read_srdf(path).taken == (("a", "b1"), ("a", "b2"))


def test_an_srdf_without_pairs_is_empty(tmp_path):
    pairs = read_srdf(srdf(tmp_path, ""))
    assert (pairs.taken, pairs.ignored, pairs.named) == ((), (), frozenset())


def test_every_fault_is_named_with_its_line(tmp_path):
    path = srdf(
        tmp_path, '<disable_collisions link1="a"/>\n<disable_collisions link2=" " link1="a"/>'
    )
    with pytest.raises(UrdfError) as caught:
        read_srdf(path)
    assert [fault.place for fault in caught.value.faults] == ["line 3", "line 4"]
    assert "has no link2" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("<robot", "broken XML"),
        ("<sdf/>", "an SRDF starts with <robot"),
        ('<robot name="a"><link name="l"/></robot>', "this is a URDF"),
        ('<!DOCTYPE r [<!ENTITY a "b">]><robot/>', "DOCTYPE"),
        ("<robot>" + "<a>" * 100 + "</a>" * 100 + "</robot>", "nested more than 64"),
        ("<robot>" + "<a/>" * 60_000 + "</robot>", "more than 50,000 XML elements"),
        ("PK\x03\x04", "binary file"),
    ],
)
def test_what_is_no_srdf_is_refused(tmp_path, text, words):
    path = tmp_path / "bad.srdf"
    path.write_text(text)
    with pytest.raises(UrdfError, match=words):
        read_srdf(path)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(UrdfError, match="there is no such file"):
        read_srdf(tmp_path / "no.srdf")
