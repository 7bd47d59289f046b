"""What is said of every bad input, word for word, as approved/READER/NAME.txt has it."""

import pickle
import re
from pathlib import Path

import bad_input
import pytest
from approved import Approved
from readers import READERS, of_bad

from coverable import bspline, load_case, read_net
from coverable.errors import CoverableError
from robots.urdf.checked_urdf import check_urdf
from robots.urdf.xacro_files import Caps, expanded

TABLES = tuple(sorted(path.stem for path in bad_input.TABLES.glob("*.toml")))
BAD = [(reader, name) for reader in TABLES for name in bad_input.bad(reader)]
# What parsers and numpy say differs with their version, and paths with the machine.
MASKS = {
    r"(not valid TOML: |is not JSON: |broken XML \()[^\n(]*?(?= \(at|\)|$)": r"\1#",
    r"(\.npy' is damaged: ).*": r"\1#",
    r"\S*/site-packages/": "PACKAGES/",
    re.escape(f"{Path(__file__).parents[2]}/"): "",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return bad_input.lay_out(tmp_path_factory.mktemp("input"))


def read(reader: str, name: str, folder: Path) -> str:
    one = bad_input.bad(reader)[name]
    if one.good == "set":
        load_case("paper/4a", list(map(bad_input.many, one.change))).build()
        return ""
    files = {"net": name, "trajectory": name, "poses": name, "case": "case.toml"}
    path = folder / (files.get(reader) or READERS[reader].file)
    path.write_bytes(of_bad(reader, name))
    if reader == "case":
        load_case(path).build()
    elif reader == "net":
        bspline(**read_net(path)._asdict())
    elif reader == "xacro":
        expanded(str(path), caps=Caps(seconds=1))
        check_urdf(path)
    elif reader == "urdf":
        checked = check_urdf(path)
        faults = [joint.fault for joint in checked.joints if joint.fault]
        faults += [f"link {fault.link}: {fault.why}" for fault in checked.collisions.faults]
        odd = [*checked.warnings, *faults]
        return "\n".join(odd if len(odd) < 10 else [*odd[:2], f"... {len(odd)} in all", odd[-1]])
    else:
        READERS["trajectory as CSV" if reader == "trajectory" else reader].read(path)
    return ""


@pytest.mark.parametrize(("reader", "name"), BAD, ids=map("-".join, BAD))
def test_what_is_said(reader: str, name: str, folder: Path, approved: Approved) -> None:
    refused = None
    try:
        said = f"It is read. {read(reader, name, folder)}"
    except CoverableError as error:
        said, refused = str(error), error
    if refused is not None:
        assert refused.faults
        again = pickle.loads(pickle.dumps(refused))
        assert (str(again), again.faults) == (said, refused.faults)
    assert len(said) < 4000
    assert all(line.isprintable() for line in said.split("\n"))
    said = said.replace(str(folder), "FOLDER")
    for found, instead in MASKS.items():
        said = re.sub(found, instead, said)
    approved(f"{reader}/{bad_input.slug(name)}", said)


def test_every_approved_text_is_asked_for() -> None:
    known = {f"{reader}/{bad_input.slug(name)}.txt" for reader, name in BAD}
    texts = Path(__file__).with_name("approved")
    found = {path.relative_to(texts).as_posix() for path in texts.rglob("*.txt")}
    assert {name for name in found if name.split("/")[0] in TABLES} == known


def test_what_is_accepted_can_be_counted() -> None:
    """A table of bad input in which everything was read would say nothing."""
    texts = Path(__file__).with_name("approved")
    read = {path.parent.name for path in texts.rglob("*.txt") if "It is read" in path.read_text()}
    assert read == {"urdf"}
