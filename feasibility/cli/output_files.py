"""The files that commands write."""

from __future__ import annotations

import os
from collections.abc import Mapping

from feasibility.cli.console import print_err
from feasibility.read_files import FileError, shown_path
from feasibility.safe_files import check_writable, write_whole


def check_outputs(outputs: Mapping[str, str | None], given: str = "") -> None:
    """Refuse outputs that cannot be written or would replace the input, before the work.

    Args:
        outputs: files by their flag, None where there is none.
        given: what is read: a file, or the name of a built-in case.

    Raises:
        FileError: with everything that is wrong.
    """
    faults, taken = [], dict[str, str]()
    for flag, path in outputs.items():
        if path is None:
            continue
        try:
            check_writable(path)
        except FileError as error:
            faults.append(f"{flag} {error}")
        place = os.path.realpath(path)
        if place in taken and os.path.realpath(os.devnull) != place:
            faults.append(f"{flag} {shown_path(path)}: is also the file of {taken[place]}")
        taken[place] = flag
        if os.path.isfile(given) and os.path.exists(path) and os.path.samefile(given, path):
            faults.append(f"{flag} {shown_path(path)}: is the input file; give another name")
    if faults:
        raise FileError(faults)


def write_text(path: str, text: str, what: str) -> None:
    """Write a file, and report it on stderr as `what`.

    Raises:
        FileError: the file cannot be written.
    """
    write_whole(path, lambda stream: stream.write(text.encode()))
    print_err(f"{what}: {shown_path(path)}")
