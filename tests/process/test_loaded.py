"""What a check loads: only what its case needs."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
MOST_LINES = 18_000
# Parts that paper/4a has no use for: no bodies, no roll, one patch, nothing missed, no page.
UNUSED = (
    "coverable.meshes", "robots.shapes", "surfaces.meshes.", "surfaces.piecewise.",
    "feasibility.certification.collisions.", "feasibility.certification.cut_proofs.",
    "feasibility.collisions.scene", "feasibility.collisions.kernels.segments",
    "feasibility.roadmap.causes.", "feasibility.roadmap.proofs.prover",
    "feasibility.roadmap.ordered_run", "feasibility.roadmap.proofs.branching",
    "feasibility.targets.frames", "feasibility.roadmap.rounds", "feasibility.roadmap.proving",
    "feasibility.certification.roll_", "feasibility.certification.pose_replay",
    "feasibility.roll", "feasibility.roadmap.seeds", "feasibility.roadmap.connecting",
    "feasibility.reports.objects_and_csv", "feasibility.reports.shortfalls",
    "feasibility.safe_files", "feasibility.cli.case_commands", "feasibility.cases.surface_files",
    "feasibility.targets.direction_cubics", "robots.urdf.mesh_folders", "robots.urdf.axes",
    "robots.urdf.xacro_files", "surfaces.toolpaths.", "feasibility.paper.", "feasibility.viewer",
    "feasibility.paths", "feasibility.cli.path", "feasibility.collisions.gathering",
    "surfaces.passes", "networkx", "scipy.spatial", "scipy.optimize", "urllib.request", "OCP",
    "collada", "distributed", "matplotlib", "meshcat", "trimesh", "yourdfpy",
)  # fmt: skip
CHECK = """
import os, sys
from feasibility.cli.main import main
main(["check", "paper/4a"])
for name, module in sys.modules.items():
    print(name, getattr(module, "__file__", None), sep="\\t", file=sys.stderr)
sys.stdout.flush()
os._exit(0)  # tidying up takes a third of the time
"""


def test_a_check_loads_what_its_case_needs() -> None:
    done = subprocess.run([sys.executable, "-c", CHECK], cwd=ROOT, capture_output=True, text=True,
                          check=True)  # fmt: skip
    assert done.stdout.startswith("feasible: ")
    rows = [line.split("\t") for line in done.stderr.splitlines() if "\t" in line]
    loaded = {name: ROOT / file for name, file in rows if file.endswith(".py")}
    ours = {p for p in loaded.values() if p.is_relative_to(ROOT) and ".venv" not in p.parts}
    assert len(ours) > 100
    assert {"numba", "feasibility.roadmap.complete"} <= set(loaded)
    assert [name for name, _ in rows if name.startswith(UNUSED)] == []
    assert sum(len(path.read_text("utf-8").splitlines()) for path in ours) <= MOST_LINES
