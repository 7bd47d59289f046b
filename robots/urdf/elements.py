"""Untrusted XML into a small tree with line numbers, and strict numbers and names out of it.

The reader caps bytes, elements and nesting, opens regular files only,
and refuses DOCTYPE, which is where entity bombs and external entities live. No name in the file is
ever followed: what is not in the bytes given is not read.
"""

from __future__ import annotations

import math
import os
import re
from dataclasses import dataclass, field
from xml.parsers import expat

from coverable.errors import CoverableError, Fault
from coverable.files import FileFault, read_regular, too_large
from robots.errors import RobotError

MAX_BYTES = 8 * 2**20  # the largest URDF in example-robot-data has 0.2 MB
MAX_ELEMENTS = 50_000  # the same file has 3,900
MAX_ATTRIBUTES = 64  # in one element; URDF needs 6
MAX_DEPTH = 64  # URDF needs 6
_IF_LARGER = "keep links and joints in it, and meshes in files of their own"
MAX_LENGTH = 1e4  # [m] and [rad]: nothing in a robot is larger; beyond it, numbers lose digits
MAX_NAME = 200

# float() would also take 'nan', '1_000' and digits of other scripts, which URDF readers do not.
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?", re.ASCII)

Triple = tuple[float, float, float]


class UrdfError(RobotError):
    """A URDF that cannot be used: every fault that was found, each with what would do."""


@dataclass(eq=False, slots=True)
class Node:
    """One XML element: tag, attributes, the line it starts on, and the elements inside."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Node] = field(default_factory=list)
    text: str = ""
    """What is written in it, as much as a name may have."""

    def all(self, tag: str) -> list[Node]:
        """The direct children of that tag."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> Node | None:
        """The first direct child of that tag."""
        return next((child for child in self.children if child.tag == tag), None)


def shown(text: str, width: int = 60) -> str:
    """`text` quoted for a message: escaped, and cut when it is long."""
    return repr(text if len(text) <= width else text[: width - 3] + "...")


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
        data: the document.
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
        parser.CharacterDataHandler = self.write
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

    def write(self, text: str) -> None:
        node = self.open[-1]
        if len(node.text) < MAX_NAME:
            node.text += text[:MAX_NAME]

    def end(self, _: str) -> None:
        self.open.pop()


@dataclass(eq=False, slots=True)
class Faults:
    """What is wrong with one file so far, and what is odd about it."""

    errors: list[str | Fault] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    soft_limits: list[str] = field(default_factory=list)
    """Names of joints whose controller would stop earlier than the limits do."""

    def error(self, node: Node, what: str) -> None:
        """Note something that makes the robot unusable."""
        self.errors.append(Fault("", what, f"line {node.line}"))

    def warn(self, node: Node, what: str) -> None:
        """Note something that leaves the robot correct."""
        self.warnings.append(f"line {node.line}: {what}")


class BadValue(CoverableError):
    """An attribute that does not hold what it should; the message says what would do."""


def numbers(node: Node, attribute: str, count: int, bound: float = MAX_LENGTH) -> list[float]:
    """`count` finite numbers of at most `bound` from an attribute that is there.

    Raises:
        BadValue: anything else.
    """
    text = node.attributes[attribute]
    words = text.split()
    example = " ".join(["0.1", "0", "0", "1"][:count])
    label = f"<{node.tag}> {attribute}={shown(text)}"
    if len(words) != count or not all(_NUMBER.fullmatch(word) for word in words):
        plural = "finite number" if count == 1 else "finite numbers separated by spaces"
        raise BadValue(f'{label} must be {count} {plural}, such as "{example}"')
    values = [float(word) for word in words]
    if not all(math.isfinite(value) and abs(value) <= bound for value in values):
        most = f" of at most {bound:g}" if math.isfinite(bound) else ""
        raise BadValue(f"{label} must hold finite numbers{most}")
    # Some readers refuse subnormal numbers.
    return [value if abs(value) > 1e-200 else 0.0 for value in values]


def number(node: Node, attribute: str, default: float, bound: float = MAX_LENGTH) -> float:
    """One number as by `numbers`, or `default` where the attribute is missing."""
    return numbers(node, attribute, 1, bound)[0] if attribute in node.attributes else default


def triple(node: Node | None, attribute: str, default: Triple) -> Triple:
    """Three numbers, or `default` where element or attribute are missing.

    Raises:
        BadValue: the attribute holds anything else.
    """
    if node is None or attribute not in node.attributes:
        return default
    x, y, z = numbers(node, attribute, 3)
    return x, y, z


def name_of(
    node: Node, faults: Faults, attribute: str = "name", owner: str | None = None
) -> str | None:
    """A usable name, or None with the fault noted."""
    text = node.attributes.get(attribute)
    which = f"{owner}: <{node.tag}>" if owner else f"<{node.tag}>"
    if not text or not text.strip():
        faults.error(node, f'{which} has no {attribute}; write {attribute}="..."')
    elif len(text) > MAX_NAME or not text.isprintable() or text != text.strip():
        faults.error(
            node,
            f"{which} {attribute}={shown(text)} must be 1 to {MAX_NAME} printable "
            "characters without spaces at its ends",
        )
    else:
        return text
    return None


def only(node: Node, tag: str, faults: Faults, owner: str) -> Node | None:
    """The one child of that tag; several are a fault, because readers differ on which counts."""
    found = node.all(tag)
    if len(found) > 1:
        lines = ", ".join(str(child.line) for child in found[:5])
        faults.error(
            node, f"{owner} has {len(found)} <{tag}> elements (lines {lines}); keep one of them"
        )
    return found[0] if found else None


def is_xacro(path: str | os.PathLike[str]) -> bool:
    """True for a file name that ends in .xacro.

    Example:
        >>> is_xacro("arm.urdf.xacro"), is_xacro("arm.urdf")
        (True, False)
    """
    return os.fsdecode(path).lower().endswith(".xacro")
