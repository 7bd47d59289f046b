"""Untrusted XML into a small tree with line numbers, or one clear refusal.

Nothing here knows robots. The reader caps bytes, elements and nesting, opens regular files only,
and refuses DOCTYPE, which is where entity bombs and external entities live. No name in the file is
ever followed: what is not in the bytes given is not read.
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.parsers import expat

from coverable_errors import Fault
from coverable_files import FileFault, read_regular, too_large
from robots.errors import RobotError

MAX_BYTES = 8 * 2**20  # the largest URDF in example-robot-data has 0.2 MB
MAX_ELEMENTS = 50_000  # the same file has 3,900
MAX_ATTRIBUTES = 64  # in one element; URDF needs 6
MAX_DEPTH = 64  # URDF needs 6
_IF_LARGER = "keep links and joints in it, and meshes in files of their own"


class UrdfError(RobotError):
    """A URDF that cannot be used: every fault that was found, each with what would do."""


@dataclass(eq=False, slots=True)
class Node:
    """One XML element: tag, attributes, the line it starts on, and the elements inside."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Node] = field(default_factory=list)

    def all(self, tag: str) -> list[Node]:
        """The direct children of that tag."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> Node | None:
        """The first direct child of that tag."""
        return next((child for child in self.children if child.tag == tag), None)


def shown(text: str, width: int = 60) -> str:
    """`text` quoted for a message: escaped, and cut when it is long."""
    return repr(text if len(text) <= width else text[: width - 3] + "...")


def nearest(word: str, known: Sequence[str], cutoff: float = 0.6) -> str | None:
    """The one of `known` that `word` was probably meant to be; None if there is none."""
    if len(word) > 40:  # matching takes time, and nobody misspells at this length
        return None
    return next(iter(difflib.get_close_matches(word.strip().lower(), known, 1, cutoff)), None)


def read_bytes(path: str) -> bytes:
    """Read a regular file of at most MAX_BYTES; never blocks on a pipe or a device.

    Raises:
        UrdfError: it is missing, unreadable, empty, too big or not a regular file.
    """
    try:
        return read_regular(path, MAX_BYTES, "a URDF file", _IF_LARGER)
    except FileFault as error:
        raise UrdfError(error.faults, path if path.isprintable() else shown(path)) from None


def parse_xml(data: bytes, path: str, encoding: str | None = None) -> Node:
    """Parse XML into nodes.

    Args:
        data: the whole document.
        path: what to call it in messages.
        encoding: overrides what the document declares.

    Raises:
        UrdfError: not well-formed, a DOCTYPE, or over a cap.
    """
    if len(data) > MAX_BYTES:
        raise UrdfError(too_large(MAX_BYTES, "a URDF file", _IF_LARGER), path)
    hint = _foreign(data)
    if hint:
        raise UrdfError(f"{hint}; a URDF is XML that starts with <robot name=...>", path)
    parser = expat.ParserCreate(encoding)
    builder = _Builder(parser, path)
    try:
        parser.Parse(data, True)
    except UrdfError:  # from the handlers; a ValueError too
        raise
    except expat.ExpatError as error:
        what = expat.ErrorString(error.code) or "not XML"
        raise UrdfError(
            f"line {error.lineno}: broken XML ({what}); correct the file or export it again", path
        ) from None
    except (LookupError, ValueError) as error:
        raise UrdfError(
            f"line 1: its encoding cannot be read ({error}); save it as UTF-8", path
        ) from None
    if builder.root is None:
        raise UrdfError("holds no XML element; a URDF starts with <robot name=...>", path)
    return builder.root


def _foreign(data: bytes) -> str | None:
    """What a file is that is plainly no XML, or None."""
    head = data[:512].lstrip(b"\xef\xbb\xbf \t\r\n")
    if not data.lstrip(b"\xef\xbb\xbf \t\r\n"):
        return "is empty"
    if head.startswith((b"\xff\xfe", b"\xfe\xff", b"<\x00", b"\x00<")):
        return None  # UTF-16
    if b"\0" in head or head.startswith((b"\x89PNG", b"\x1f\x8b", b"PK", b"\xff\xd8")):
        return "is a binary file"
    if not head.startswith(b"<"):
        return f"starts with {shown(head[:20].decode('latin-1'))}, so it is not XML"
    return None


class _Builder:
    """Collects the elements that expat reports, and stops it at the first thing not allowed."""

    def __init__(self, parser: expat.XMLParserType, path: str) -> None:
        self.parser = parser
        self.path = path
        self.root: Node | None = None
        self.open: list[Node] = []
        self.count = 0
        parser.StartElementHandler = self.start
        parser.EndElementHandler = self.end
        parser.StartDoctypeDeclHandler = self.doctype
        parser.EntityDeclHandler = self.doctype

    def refuse(self, what: str) -> None:
        place = f"line {self.parser.CurrentLineNumber}"
        raise UrdfError(Fault("", what, place), self.path)

    def doctype(self, *_: object) -> None:
        self.refuse(
            "holds a DOCTYPE, which can pull in other files or grow without bound; delete it "
            "(a URDF needs none; a web page is not a URDF)"
        )

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.count += 1
        if self.count > MAX_ELEMENTS:
            self.refuse(f"has more than {MAX_ELEMENTS:,} XML elements; give the arm alone")
        if len(self.open) >= MAX_DEPTH:
            self.refuse(
                f"elements are nested more than {MAX_DEPTH} deep; a URDF lists its links and "
                "joints side by side"
            )
        if len(attributes) > MAX_ATTRIBUTES:
            self.refuse(
                f"<{tag[:60]}> has {len(attributes):,} attributes, more than {MAX_ATTRIBUTES}; "
                "no element of a URDF has as many"
            )
        node = Node(tag, attributes, self.parser.CurrentLineNumber)
        if self.open:
            self.open[-1].children.append(node)
        else:
            self.root = node
        self.open.append(node)

    def end(self, _: str) -> None:
        self.open.pop()
