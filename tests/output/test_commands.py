"""What commands say, to whom and with which status: approved texts, with numbers masked."""

from __future__ import annotations

import itertools
import re
import shlex

import pytest
from command_table import COMMANDS, NEEDS, REFUSED, TABLE

from feasibility.cli.main import _parser

CHOICES = re.compile(r"\(choose from .*?\)")  # each version of Python has other quotes
STATUS = ("zero", "one", "two", "three")


def unwrapped(text):
    """Lines that were broken at 100 columns in one: where that is depends on the numbers."""
    lines = text.splitlines()
    found = lines[:1]
    for before, line in itertools.pairwise(lines):
        first = re.match(r" *(\S+(?: (?:deg|mm|m2|m/s|m|s|%)(?!\w))?)", line)
        indent, same = (len(each) - len(each.lstrip()) for each in (line, before))
        broken = first and len(before) + 1 + len(first[1]) > 100 >= len(before)
        if broken and (indent >= 10 or indent == same):
            found[-1] += f" {line.strip()}"
        else:
            found.append(line)
    return "\n".join(re.sub(r"(?<=\S) {2,}", "  ", line) for line in found if line)


def transcript(line, said):
    """A command with its answer, as on a terminal."""
    parts = [f"$ coverable {line}".rstrip(), f"exit status {STATUS[said.status]}"]
    for name, text in (("stdout", said.out), ("stderr", said.err)):
        if text:
            parts += [f"-- {name}", unwrapped(text.rstrip())]
    return "\n".join(parts)


def masked(text, commands):
    """Without the folder, and without what each version of Python writes in its own way."""
    return CHOICES.sub("(choose from ...)", text).replace(str(commands.folder), "FOLDER")


@pytest.mark.parametrize(("command", "name"), COMMANDS)
def test_what_a_command_says(commands, approved, command, name):
    said = commands.run(command, name)
    text = transcript(f"{command} {TABLE[command][name]}", said)
    approved(f"{command}/{name}", masked(text, commands), numbers=False)


@pytest.mark.parametrize("command", REFUSED)
def test_what_is_refused_is_one_message_on_stderr_and_status_2(commands, approved, command):
    for needed in NEEDS.values():
        commands.run(*needed)
    texts = []
    for line in REFUSED[command]:
        line = line if command == "coverable" else f"{command} {line}"
        before = {file.name for file in commands.folder.iterdir()}
        said = commands.say(shlex.split(line))
        assert (said.status, said.out) == (2, ""), line
        assert said.err.count("coverable: ") <= 1
        assert "bug" not in said.err
        assert {file.name for file in commands.folder.iterdir()} == before, "no file is written"
        texts.append(f"$ coverable {line}".rstrip() + "\n" + masked(said.err.rstrip(), commands))
    approved(f"refused/{command}", "\n".join(texts))


def test_the_flags_of_every_command(commands, approved):
    (choices,) = (action for action in _parser()._actions if action.choices)
    assert set(choices.choices) == {*TABLE, "robots", "keys", "live", "warm-up"}
    lines = []
    for command in ("", *choices.choices):
        said = commands.say([*command.split(), "--help"])
        assert (said.status, said.err) == (0, "")
        own = [line for line in said.out.splitlines() if re.match(r"  -", line)]
        flags = [word for line in own for word in re.findall(r"--[\w-]+", line)[:1]]
        lines.append(f"{command or 'coverable'}: {' '.join(flags)}")
        if "exit status" in said.out:
            text = " ".join(said.out[said.out.index("exit status") :].split())
            lines.append(f"    {text}")
    approved("flags", "\n".join(lines))
