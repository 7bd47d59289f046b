"""Faults of files are told before anything is compiled for the case."""

import os
import subprocess
import sys


def test_a_missing_urdf_is_told_before_kernels_are_compiled(tmp_path):
    (tmp_path / "sheet.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n")
    (tmp_path / "case.toml").write_text(
        '[robot]\nurdf = "nowhere.urdf"\n[surface]\nkind = "mesh"\nfile = "sheet.obj"\n'
        'side = "outside"\ncells = 4\n[task]\nstandoff = 0.1\ncone_deg = 10\n'
    )
    command = [sys.executable, "-m", "feasibility.cli", "check", "case.toml"]
    kernels = tmp_path / "kernels"
    surroundings = {**os.environ, "NUMBA_CACHE_DIR": str(kernels)}
    ended = subprocess.run(
        command, cwd=tmp_path, env=surroundings, capture_output=True, text=True, check=False
    )
    assert (ended.returncode, ended.stdout) == (2, "")
    assert "nowhere.urdf: there is no such file" in ended.stderr
    assert not list(kernels.rglob("*.nb*"))
