"""Any bytes in any file: one error with its faults, or a value that is sound and comes back."""

import os
import re
import sys
from pathlib import Path

import pytest
import samples
from approved import Approved
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from readers import READERS

from coverable.errors import CoverableError

FEW = {"xacro": 6}  # each in a process of its own
MANY = 2000
opened: list[str] = []
sys.addaudithook(lambda event, facts: opened.append(str(facts[0])) if event == "open" else None)

NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
QUOTED = re.compile(rb'"([^"\n]*)"')
ODD = (
    b"nan", b"-inf", b"1e400", b"1e308", b"-1e16", b"0", b"-1", b"0.5", b"2147483648", b"true",
    b"9" * 400, b"9" * 5000, b"1 2", b"1,5", b"0x10", b"1_0", b"", b" ", b"null", b"{}", b"[]",
    b"[[]]", b"\xff", b"\0", b"&x;", b"${x}", b"../../x.stl", b"/etc/passwd", b"/dev/zero",
    b"fixed", b"continuous", b"universe", b"link1", b"mesh", b"sphere", "é\u202e".encode(),
)  # fmt: skip
PIECES = (
    b'"', b"'", b"<", b">", b"/>", b"&", b"]]>", b"-->", b"<!--", b"<!DOCTYPE a>", b"[", b"]",
    b"{", b"}", b",", b"\n", b"\r\n", b"\t", b"#", b"=", b"\n[a.b]\n", b"\\", b"\0\0\0\0",
    b"\xff\xff\xff\xff", b"</robot>", b"<axis/>", b'<mimic joint="x"/>', b"\xef\xbb\xbf", b"(" * 99,
)  # fmt: skip


@st.composite
def spoiled(draw: st.DrawFn, good: bytes) -> bytes:
    """A good file with some numbers, names, lines or bytes changed, or cut short."""
    data = good
    for _ in range(draw(st.integers(1, 3))):
        kind = draw(st.sampled_from(("number", "number", "name", "line", "bytes", "end")))
        found = {
            "number": [one.span() for one in NUMBER.finditer(data)],
            "name": [one.span(1) for one in QUOTED.finditer(data)],
            "line": [one.span() for one in re.finditer(rb"[^\n]+\n", data)],
        }.get(kind, [])
        if found:
            start, end = draw(st.sampled_from(found))
            other = data[slice(*draw(st.sampled_from(found)))]
            odd = (b"", data[start:end] * 2) if kind == "line" else ODD
            piece = draw(st.sampled_from((*odd, other)))
        else:
            start = draw(st.integers(0, len(data)))
            end = min(len(data), start + draw(st.integers(0, 40)))
            piece = draw(st.sampled_from(PIECES) | st.binary(max_size=8))
        data = data[:start] + piece + (b"" if kind == "end" else data[end:])
    return data


def read(name: str, data: bytes, folder: Path) -> object:
    """What is read of these bytes, or None; nothing else is opened for them."""
    reader = READERS[name]
    path = folder / reader.file
    path.write_bytes(data)
    opened.clear()
    found = refused = None
    try:
        found = reader.read(path)
    except CoverableError as error:
        refused = error
    if refused is not None:
        assert refused.faults
        assert all(line.isprintable() for line in str(refused).split("\n"))
        assert len(str(refused)) < 8000
    inside = {Path(one).name for one in opened if one.startswith(str(folder))}
    assert inside <= {reader.file}
    assert not [one for one in opened if re.match("/etc|/dev/(?!null)", one)]
    return found


@pytest.mark.parametrize("name", READERS)
def test_the_good_file_is_read(name: str, tmp_path: Path) -> None:
    found = read(name, READERS[name].good(), tmp_path)
    assert found is not None
    READERS[name].sound(found, tmp_path)


@pytest.mark.sampled
@pytest.mark.parametrize("name", READERS)
def test_nothing_else_gets_through(name: str, tmp_path: Path) -> None:
    @settings(
        max_examples=MANY if samples.EVERYTHING else FEW.get(name, 25),
        suppress_health_check=[HealthCheck.too_slow],
    )
    @given(spoiled(READERS[name].good()) | st.binary(max_size=200))
    @example(b"")
    @example(b"\0" * 100)
    @example(b"\xff\xfe")
    @example(b"[" * 100_000)
    @example(b"\x93NUMPY\x01\x00v\x00" + b"'{'descr': '<f8', }".ljust(117) + b"\n")
    def asked(data: bytes) -> None:
        found = read(name, data, tmp_path)
        if found is not None:
            READERS[name].sound(found, tmp_path)

    asked()


SPECIAL = {
    "folder": "is a folder; expected a",
    "pipe": "is not a regular file but a pipe, socket or device",
    "device": "is not a regular file but a pipe, socket or device",
    "dangling": "there is no such file; expected a",
    "circle": "cannot be opened: too many levels of symbolic links",
    "beyond": "cannot be opened: not a directory",
    "missing": "there is no such file; expected a",
    "NUL": "no file can have that name",
    "long": "cannot be opened: file name too long",
}


def special(kind: str, folder: Path, file: str) -> Path:
    path = folder / kind / file
    path.parent.mkdir(parents=True)
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind in ("device", "dangling", "circle"):
        path.symlink_to({"device": "/dev/zero", "circle": file}.get(kind, "nowhere"))
    elif kind == "beyond":
        path.touch()
        path /= file
    odd = {"NUL": f"a\0{file}", "long": "x" * 5000 + file}
    return folder / odd[kind] if kind in odd else path


@pytest.mark.parametrize("kind", SPECIAL)
def test_only_regular_files_are_read(kind: str, tmp_path: Path) -> None:
    """None of these is waited for."""
    for name, reader in READERS.items():
        with pytest.raises(CoverableError) as caught:
            reader.read(special(kind, tmp_path / name, reader.file))
        assert SPECIAL[kind] in str(caught.value), name


def test_no_file_is_read_beyond_its_cap(tmp_path: Path, approved: Approved) -> None:
    said = {}
    for reader in READERS.values():
        path = tmp_path / reader.file
        path.touch()
        os.truncate(path, 1 << 40)  # takes no room on the disk
        with pytest.raises(CoverableError) as caught:
            reader.read(path)
        said[reader.file] = str(caught.value).split(": ", 1)[1]
        path.unlink()
    approved("special/terabyte", "\n".join(f"{name}: {text}" for name, text in said.items()))
