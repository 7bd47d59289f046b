"""URDFs that are strings, checked as files are."""

from __future__ import annotations

from robots.urdf import CheckedUrdf
from robots.urdf.checked_urdf import checked_tree
from robots.urdf.tree import refuse_other_formats
from robots.urdf.xml import parse_xml


def check_urdf_text(text: str, name: str = "URDF text") -> CheckedUrdf:
    """Check a URDF that is a string; it has no folder in which its meshes could be found."""
    root = parse_xml(text.encode(), name, encoding="utf-8")
    refuse_other_formats(root, name)
    return checked_tree(root, name, "/nowhere", ())
