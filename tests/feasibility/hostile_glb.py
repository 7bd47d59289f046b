"""GLB files that are traps: instances, lengths, texts, and pictures."""

from __future__ import annotations

import json
import random
import struct
import zlib
from pathlib import Path

from hostile_parts import DRAWN, TRIANGLE, trap, write


def glb(scene: object, numbers: bytes = b"", json_text: str = "") -> bytes:
    """A .glb of a scene, or of a text in its place."""
    text = (json_text or json.dumps(scene)).encode()
    text += b" " * (-len(text) % 4)
    numbers += b"\0" * (-len(numbers) % 4)
    size = 28 + len(text) + len(numbers)
    head = struct.pack("<4sIIII", b"glTF", 2, size, len(text), 0x4E4F534A)
    return head + text + struct.pack("<II", len(numbers), 0x004E4942) + numbers


def scene_of(triangles: int = 1, **changes: object) -> tuple[dict[str, object], bytes]:
    """A scene that shows one mesh of so many triangles once, and its numbers."""
    data = struct.pack("<9f", *map(float, TRIANGLE.split())) * triangles
    scene: dict[str, object] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3 * triangles, "type": "VEC3"}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "buffers": [{"byteLength": len(data)}],
    }
    return {**scene, **changes}, data


def glb_instances(rng: random.Random, folder: Path) -> tuple[str, str]:
    """One mesh in many nodes, or in many primitives."""
    triangles, times = rng.choice(((1, 50_000), (1, 150_000), (20_000, 300), (300, 9_000)))
    if rng.random() < 0.5:
        mesh = {"primitives": [{"attributes": {"POSITION": 0}}] * times}
        scene, data = scene_of(triangles, meshes=[mesh])
    else:
        nodes = [{"mesh": 0}] * times
        scene, data = scene_of(triangles, nodes=nodes, scenes=[{"nodes": [*range(times)]}])
    return write(folder, "many.glb", glb(scene, data)), r"more than|lists \d+"


def glb_nodes(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Nodes in a circle, or that share their children level by level."""
    levels = rng.choice((20, 60, 500))
    shared = [{"children": [k + 1, k + 1]} for k in range(levels)] + [{"mesh": 0}]
    circle = [{"children": [(k + 1) % levels], "mesh": 0} for k in range(levels)]
    scene, data = scene_of(nodes=rng.choice((shared, circle)))
    return write(folder, "nodes.glb", glb(scene, data)), "must form a tree"


def glb_numbers(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Lengths, counts and offsets that are not there."""
    scene, data = scene_of()
    table, key = rng.choice(
        (("accessors", "count"), ("bufferViews", "byteLength"), ("bufferViews", "byteOffset"),
         ("accessors", "byteOffset"), ("accessors", "bufferView"), ("bufferViews", "buffer"))
    )  # fmt: skip
    value = rng.choice((1 << 40, (1 << 40) - 1, 1 << 31, 1 << 63, -1, 10**400, 1e300, None, "9"))
    scene[table][0][key] = value  # type: ignore[index]
    if key == "byteLength":  # a longer view alone harms nobody: make somebody want it
        scene["accessors"][0]["count"] = 10**9  # type: ignore[index]
    return write(folder, "numbers.glb", glb(scene, data)), r"numbers\.glb: \w"


def glb_head(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Lengths in the head that are not there."""
    data = bytearray(glb(*scene_of()))
    place = rng.choice((8, 12, len(data) - 36 - 8))
    data[place : place + 4] = struct.pack("<I", rng.choice((0, 1 << 31, (1 << 32) - 1)))
    return write(folder, "head.glb", bytes(data)), r"head\.glb: \w"


def glb_text(rng: random.Random, folder: Path) -> tuple[str, str]:
    """JSON that is deep, long, or no scene."""
    texts = ["[" * 200_000, '{"a":' * 50_000, "[" + "0," * 4_000_000 + "0]", '{"scene": 1e999}']
    texts += ['{"nodes": ' + "9" * 5000 + "}", "null", '{"nodes": NaN}', '"\\ud800"', "[]"]
    return write(folder, "text.glb", glb(None, json_text=rng.choice(texts))), r"text\.glb: \w"


def glb_textures(rng: random.Random, folder: Path) -> tuple[str, str]:
    """A picture beside the file, or one inside that inflates to a billion pixels."""
    side = rng.choice((20_000, 60_000))
    rows = zlib.compress(bytes(side * (side // 8 + 1) // 50))
    chunks = ((b"IHDR", struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0)), (b"IDAT", rows))
    png = b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in (*chunks, (b"IEND", b""))
    )
    scene, data = scene_of(textures=[{"source": 0}])
    inside = rng.random() < 0.5
    scene["images"] = [{"bufferView": 1} if inside else {"uri": trap(rng, folder, "image.png")}]
    scene["bufferViews"] += [  # type: ignore[operator]
        {"buffer": 0, "byteOffset": len(data), "byteLength": len(png)}
    ]
    index = {"index": 0}
    scene["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": index}, "normalTexture": index}
    ]
    scene["meshes"][0]["primitives"][0]["material"] = 0  # type: ignore[index]
    return write(folder, "painted.glb", glb(scene, data + png)), DRAWN


def glb_outside(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Numbers in a file beside it."""
    scene, data = scene_of(buffers=[{"uri": trap(rng, folder, "numbers.bin"), "byteLength": 36}])
    return write(folder, "outside.glb", glb(scene, data)), "lies outside the file"
