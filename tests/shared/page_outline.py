"""What a page shows, read back from the page itself: texts, tables, legend, objects and tracks."""

import base64
import gzip
import io
import re
from collections import Counter
from html.parser import HTMLParser
from typing import Any

import numpy as np
import umsgpack

READ_OUT = re.compile(r" \| (deg|mm) \|$")
ALIKE = r"/robot/.*(link |frame of|flange to)|/ground|/root frame"
SMALL = 1e-4  # [m], so that a box at half a centimetre is rounded the same way everywhere


def points_of(command: dict[str, Any]) -> np.ndarray:
    """The corners (k, 3) m of an object, in the frame of its path."""
    array = command["object"]["geometries"][0]["data"]["attributes"]["position"]["array"]
    return np.frombuffer(array.data, "<f4").reshape(-1, 3).astype(float)


def faces_of(command: dict[str, Any]) -> np.ndarray:
    """Its triangles (f, 3)."""
    index = command["object"]["geometries"][0]["data"]["index"]
    kind = {"Uint16Array": "<u2", "Uint32Array": "<u4"}[index["type"]]
    return np.frombuffer(index["array"].data, kind).reshape(-1, 3).astype(int)


def tracks_of(commands: Any) -> dict[tuple[str, str], tuple[np.ndarray, Any]]:
    """What moves: (path, property) -> times (s), values."""
    found = {}
    for one in (c for c in commands if c["type"] == "set_animation"):
        for part in one["animations"]:
            for keys in part["clip"]["tracks"]:
                values = keys["values"]
                if hasattr(values, "data"):
                    values = np.frombuffer(values.data, "<f4").astype(float)
                times = np.frombuffer(keys["times"].data, "<f4").astype(float)
                found[part["path"], keys["name"]] = times, values
    return found


def unpacked(data: bytes) -> list[dict[str, Any]]:
    """Commands to the viewer, each after its length."""
    found, rest = [], io.BytesIO(data)
    while length := rest.read(4):
        found.append(umsgpack.unpackb(rest.read(int.from_bytes(length, "little"))))
    return found


class Page(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.text, self.tags, self.attributes = text, Counter[str](), list[tuple[str, Any]]()
        self.lines, self._open, self._row = list[str](), list[str](), list[str]()
        self._switch = False
        self.feed(text)
        self.frames = [Page(value) for name, value in self.attributes if name == "srcdoc"]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, Any]]) -> None:
        """Count it; switches of the legend are lines of their own."""
        self.tags[tag] += 1
        self.attributes += attrs
        given = dict(attrs)
        if tag not in ("input", "meta", "br", "img", "line", "rect", "link", "i", "b"):
            self._open.append(tag)
        if tag == "input" and "data-path" in given:
            box = "[x]" if "checked" in given else "[ ]"
            self.lines.append(f"{box} {given['data-path']}:")
        if tag == "i" and "background:#" in given.get("style", ""):
            self._row.append(given["style"].partition(":")[2])
            self._switch = bool(self.lines) and self.lines[-1].startswith("[")

    def handle_endtag(self, tag: str) -> None:
        """Rows of tables become lines."""
        if tag in self._open:
            while self._open.pop() != tag:
                pass
        if tag in ("tr", "p", "h1", "h2", "summary", "label", "li", "div", "figcaption"):
            self._end()

    def handle_data(self, data: str) -> None:
        """Text, but for programs and styles."""
        if data.strip() and not {"script", "style", "title"} & set(self._open):
            self._row.append(" ".join(data.split()))
            self._row += ["|"] * ("td" in self._open or "th" in self._open)

    def _end(self) -> None:
        text, self._row = " ".join(self._row), []
        if self._switch:
            text, self._switch = f"{self.lines.pop()} {text}", False
        if text:
            self.lines.append(text)

    def block(self, name: str) -> bytes:
        """What the page unpacks from a block of data."""
        found = re.search(rf'id="{name}">([^<]*)<', self.text)
        assert found is not None, f"no block {name}"
        return gzip.decompress(base64.b64decode(found[1]))

    @property
    def commands(self) -> list[dict[str, Any]]:
        """Of the scene, in their order."""
        return unpacked(self.block("commands"))

    def outline(self) -> str:
        """Texts, tables and legend; of objects their boxes to 1 cm; what moves."""
        self._end()
        lines = [f"tags: {', '.join(sorted(set(self.tags)))}"]
        for line in self.lines:  # of the read-out in one
            joined = READ_OUT.search(line) and READ_OUT.search(lines[-1])
            lines[-1:] = [f"{lines[-1]} {line}"] if joined else [lines[-1], line]
        if 'id="commands"' in self.text:
            boxes = scene_outline(self.commands)
            for k, line in enumerate(lines):  # of objects in the legend beside it
                if line.startswith("["):
                    path = line[4:].partition(": ")[0]
                    box = boxes.pop(re.sub(r"\d+$", "#", path), "")
                    lines[k] = f"{line} {box}".rstrip()
            lines += [f"{path}: {box}" for path, box in boxes.items()]
        for frame in self.frames:
            lines += ["", "in a frame:", frame.outline()]
        return "\n".join(lines)


def scene_outline(commands: Any) -> dict[str, str]:
    """The box of each object by path but arm, ground and frames; numbered ones are one box."""
    corners: dict[str, list[np.ndarray]] = {}
    for one in commands:
        if one["type"] == "set_object" and not re.match(ALIKE, one["path"]):
            corners.setdefault(re.sub(r"\d+$", "#", one["path"]), []).append(points_of(one))
    boxes = {}
    for path, parts in corners.items():
        ends = np.concatenate(parts)
        low, high = (np.floor((end + SMALL) * 100 + 0.5) / 100 + 0.0
                     for end in (ends.min(axis=0), ends.max(axis=0)))  # fmt: skip
        box = " ".join(f"{a:.2f}..{b:.2f}" for a, b in zip(low, high, strict=True))
        boxes[_short(path)] = box
    tracks = [(p, n) for p, n in tracks_of(commands) if not p.startswith("/robot")]
    moving = dict.fromkeys(f"{_short(re.sub('[0-9]+$', '#', p))} {n}" for p, n in tracks)
    return boxes | ({"moves": "; ".join(moving)} if moving else {})


def _short(path: str) -> str:
    """A path without the joints that lead to its last one."""
    root, *names = path.strip("/").split("/")
    joints = [k for k, name in enumerate(names) if name.startswith("joint ")]
    return "/".join(
        ["", root, *(["..."] if joints[1:] else []), *names[joints[-1] if joints else 0 :]]
    )


def fetched(text: str) -> list[str]:
    """Whatever a page could fetch from elsewhere; the viewer's packed program names one schema."""
    plain = re.sub(r'id="(program|commands)">[^<]*<', "", text).replace('"ws://"', "")
    own = Page(text)
    names = {name for name, value in own.attributes if not str(value).startswith("data:image/png")}
    asked = {"src", "href", "srcset", "action", "data"} & names
    tags = {"link", "object", "base", "embed"} & set(own.tags)
    return [*re.findall(r"\w+://[\w./]*", plain.replace("http://www.w3.org/2000/svg", "")),
            *asked, *tags]  # fmt: skip
