"""Can this arm move its tool continuously over this whole surface?

The front door: everything that a user needs, by name. What a name needs is imported when the name
is first used, so `import coverable` costs nothing.

>>> from coverable import Task, check, load_robot, sphere
>>> puma = load_robot("puma560", limits="set-1")
>>> dome = sphere(radius=1.0, polar_deg=(10, 90), azimuth_deg=(10, 180), side="inside")
>>> verdict = check(puma, dome.cells(9, 10), Task(standoff=0.005, cone_deg=45))
>>> verdict.feasible, verdict.n_covered, verdict.n_edges
(True, 90, 305)
"""

from __future__ import annotations

_listed: dict[str, tuple[str, str]] = {}


def _public() -> dict[str, tuple[str, str]]:
    """The module of each public name and its name there, as `__init__.pyi` lists them."""
    if _listed:
        return _listed
    import ast
    from pathlib import Path

    found: dict[str, tuple[str, str]] = {}
    for line in ast.parse(Path(__file__).with_suffix(".pyi").read_text("utf-8")).body:
        if isinstance(line, ast.ImportFrom):
            found |= {name.name: (line.module or "", name.name) for name in line.names}
        if isinstance(line, ast.Assign):  # by another name here
            module, _, there = ast.unparse(line.value).rpartition(".")
            found[ast.unparse(line.targets[0])] = module, there
    _listed.update(found)  # all at once: another thread may look meanwhile
    return _listed


def __getattr__(name: str) -> object:
    """Import a public name from its module when it is first used."""
    from importlib import import_module

    if name == "__version__":
        return import_module("feasibility.version").version()
    if name.startswith("_") and name != "__all__":
        raise AttributeError(f"module 'coverable' has no attribute {name!r}")
    public = _public()
    if name == "__all__":
        return [*public, "__version__"]
    if name not in public:
        raise AttributeError(f"module 'coverable' has no attribute {name!r}")
    module, there = public[name]
    value = globals()[name] = getattr(import_module(module), there)
    return value


def __dir__() -> list[str]:
    """The public names."""
    return sorted([*_public(), "__version__"])
