"""The process that expands one xacro file; started by `xacro_files`, never imported by it.

xacro evaluates Python, and its guard is a list of names: a lambda gets past it, and $(eval ...) has
all built-in functions. So a file from elsewhere is kept in by three fences, each of which would do:
expressions may not name what leads out of them (`evaluate`); of all that Python reports to audit
hooks only reading from the folders of the file is allowed (`Gate`); and memory, processor time and
output have their caps.

The job comes as JSON on the standard input. What leaves is one line, "urdf" or "fault", and then
the files that were read, as JSON on one line, and the text; or what is wrong.
"""

from __future__ import annotations

import ast
import json
import os
import re
import stat
import sys
from collections.abc import Mapping
from importlib import import_module
from typing import Any
from xml.parsers import expat

MOST_FILES = 1_000  # that one file may lead to
MAX_NESTING = 5_000  # frames of Python: some 1,000 macros or elements inside one another
LONGEST = 300  # characters of what the library says

# From a generator to the frame that runs it and from there to everything; from a class upwards.
_ESCAPES = re.compile(r"__.*|(gi|ag|cr)_.*|f_(back|globals|locals|builtins|code)|mro")
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


class Refused(BaseException):
    """What the file may not do; no `except Exception` of the library catches it."""


def evaluate(expression: str, symbols: dict[str, Any], local: Any = None) -> Any:
    """Evaluate a Python expression without built-in names, and without the names that lead to them.

    Raises:
        Refused: it names something with two underscores in front, or a frame.
    """
    tree = ast.parse(expression.strip(), "<expression>", "eval")
    for node in ast.walk(tree):
        name = str(getattr(node, "attr", None) or getattr(node, "id", ""))
        if _ESCAPES.fullmatch(name):
            raise Refused(f"uses {name!r} in an expression, which is not allowed; leave it out")
    dict.__setitem__(symbols, "__builtins__", {})
    return eval(compile(tree, "<expression>", "eval"), symbols, local)


class Gate:
    """An audit hook that lets the library read from some folders, and do nothing else."""

    def __init__(self, folders: list[str], most: int) -> None:
        """Allow regular files of at most `most` bytes in folders given by their real paths."""
        self.folders = folders
        self.most = most
        self.seen: dict[str, None] = {}  # files and folders that were looked at

    def __call__(self, event: str, args: tuple[Any, ...]) -> None:
        """Refuse what is not reading.

        Raises:
            Refused: the event is not allowed.
        """
        if event in ("builtins.id", "compile", "exec", "glob.glob", "glob.glob/2"):
            return
        if event == "open" and not args[2] & _WRITING:
            self._may_read(args[0])
        elif event in ("os.scandir", "os.listdir"):
            self._inside(args[0])
        else:
            raise Refused(f"would do more than read files ({event}), which is not allowed")

    def _may_read(self, path: Any) -> None:
        real = self._inside(path)
        try:
            status = os.stat(real)
        except (OSError, ValueError):
            return  # opening it says what is wrong
        if not stat.S_ISREG(status.st_mode):
            raise Refused(f"would read {str(path)!r}, which is not a regular file")
        if status.st_size > self.most:
            raise Refused(f"would read {str(path)!r}, which is larger than {self.most:,} bytes")

    def _inside(self, path: Any) -> str:
        real = os.path.realpath(path) if isinstance(path, str) and "\0" not in path else ""
        if not any(os.path.join(real, "").startswith(folder) for folder in self.folders):
            raise Refused(
                f"would read {str(path)[:LONGEST]!r}, which lies outside the folders that files "
                "may come from; add its folder to package_dirs"
            )
        self.seen[os.path.abspath(path)] = None
        if len(self.seen) > MOST_FILES:
            raise Refused(f"would read more than {MOST_FILES:,} files")
        return real


class Arguments(dict[str, str]):
    """The given arguments, and which the file uses."""

    def __init__(self, given: Mapping[str, str]) -> None:
        """Start with none used."""
        super().__init__(given)
        self.given = tuple(given)
        self.used: set[str] = set()

    def __contains__(self, name: object) -> bool:
        """As <xacro:arg> asks."""
        self.used.add(str(name))
        return super().__contains__(name)

    def __getitem__(self, name: str) -> str:
        """As $(arg ...) asks."""
        self.used.add(name)
        return super().__getitem__(name)

    def refuse_unused(self) -> None:
        """Refuse arguments that the file does not use, which xacro passes over in silence.

        Raises:
            Refused: there are some.
        """
        unused = [name for name in self.given if name not in self.used]
        if unused:
            known = ", ".join(sorted(self.used)) or "none"
            raise Refused(f"has no argument {unused[0]!r} of xacro_args; its arguments: {known}")


def find_package(name: str, job: Mapping[str, Any]) -> str:
    """The folder of a ROS package, as `package://` finds it.

    Raises:
        Refused: it is in none of the folders that files may come from.
    """
    plain = name.replace("_", "a").replace("-", "a").replace(".", "a").isalnum()
    if plain and name.strip("."):
        folders = [os.path.join(folder, name) for folder in job["packages"]]
        folders += [folder for folder in job["roots"] if os.path.basename(folder) == name]
        for folder in folders:
            if os.path.isdir(folder):
                return folder
        if name in job["seen"]:
            return str(job["seen"][name])
    raise Refused(
        f"asks for the package {name!r}, which is not found; add the folder above it to "
        f"package_dirs ({job['unseen']})"
    )


def _no_environment(name: str) -> str:
    raise Refused(
        f"asks for the environment variable {name!r}, and none is read; write $(arg {name}) there "
        "and give it in xacro_args"
    )


def expand(job: Mapping[str, Any]) -> tuple[str, list[str]]:
    """Expand a xacro file; the audit hook stays for as long as the process lives.

    Args:
        job: see `xacro_files`.

    Returns:
        The text, and the files and folders that were looked at for it.

    Raises:
        Refused: the file does what it may not.
        Exception: whatever the library raises.
    """
    import xacro
    from xacro import substitution_args as given

    def find(name: str) -> str:
        folder = find_package(name, job)
        if folder == job["seen"].get(name):  # it may be read once it is asked for
            gate.folders.append(os.path.join(os.path.realpath(folder), ""))
        return folder

    def eval_in_brackets(expression: str, context: dict[str, Any]) -> str:
        values = context["arg"]
        functions = {**given._eval_dict["__builtins__"], **given._eval_dict}
        functions["arg"] = lambda name: given.convert_value(values[name], "auto")
        return str(evaluate(expression, {}, given._DictWrapper(values, functions)))

    xacro.safe_eval = evaluate
    xacro._global_symbols["python"].pop("vars")  # dunder names as text
    xacro._global_symbols["python"]["type"] = lambda value: type(value)  # makes no classes
    given._eval_find, given._eval_env, given._eval = find, _no_environment, eval_in_brackets
    given._eval_dict.update(find=find, env=_no_environment)
    arguments = Arguments(job["args"])
    import_module("xml.dom.expatbuilder")  # minidom would import it behind the gate
    sys.setrecursionlimit(MAX_NESTING)
    gate = Gate(job["folders"], job["bytes"])
    sys.addaudithook(gate)
    text: str = xacro.process_file(job["path"], mappings=arguments, verbosity=0).toprettyxml("  ")
    arguments.refuse_unused()
    return text, list(gate.seen)


def described(error: BaseException) -> str:
    """What is wrong with the file, in a sentence."""
    deepest: BaseException = error
    where = getattr(error, "suffix", None)
    while isinstance(cause := getattr(deepest, "exc", None), BaseException):
        deepest = cause
        where = getattr(deepest, "suffix", None) or where
    words = f"{deepest} {where or ''}".split() or [type(deepest).__name__]
    said = " ".join(words)[:LONGEST]
    if isinstance(deepest, FileNotFoundError):
        return f"asks for {str(deepest.filename)!r}, which is not there; correct its name"
    if isinstance(deepest, NameError):
        return f"{said}; define it with <xacro:property>, or as an argument"
    if type(deepest).__name__ == "ArgException":
        return f"$(arg {deepest}) has no value; give it in xacro_args"
    if isinstance(deepest, RecursionError):
        return "goes on without end: a macro or an include comes back to itself"
    if isinstance(deepest, MemoryError):
        return "needs too much memory; does a macro or an expression grow without bound?"
    if isinstance(deepest, expat.ExpatError):
        return f"line {deepest.lineno}: broken XML ({expat.ErrorString(deepest.code)})"
    if isinstance(deepest, UnicodeDecodeError):
        return "is not UTF-8; save it as UTF-8"
    return said


def place() -> str:
    """The file and the macro that the library works on."""
    import xacro

    files, macros = xacro.filestack or [], xacro.macrostack or []
    words = [str(files[-1])] if len(files) > 1 else []
    words += [f"macro {macros[-1].body.getAttribute('name')!r}"] if macros else []
    return ", ".join(words)


def main() -> None:
    """Do the job on the standard input."""
    job = json.load(sys.stdin)
    sys.path[:0] = job["library"]
    try:
        text, files = expand(job)
        urdf = text.encode()
        kind, answer = "urdf", json.dumps(files).encode() + b"\n" + urdf
        if len(urdf) > job["bytes"]:
            raise Refused(f"expands to more than {job['bytes']:,} bytes, too large for a URDF")
    except (Exception, Refused) as error:  # noqa: BLE001 - the library raises of all kinds
        kind = "fault"
        answer = json.dumps({"fault": described(error), "place": place()}).encode()
    sys.stdout.buffer.write(kind.encode() + b"\n" + answer)
    sys.stdout.buffer.flush()
    os._exit(0)  # the gate would refuse what Python does at its end


if __name__ == "__main__":
    main()
