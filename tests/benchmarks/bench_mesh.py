"""Cutting meshes into cells: time, memory, and how even and compact the cells are."""

from __future__ import annotations

import math
import resource
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "surfaces"))

from mesh_patches import PATCHES, Mesh, blade, hood

from surfaces.meshes.cells.clustering import cells_for
from surfaces.meshes.cells.properties import Figures, figures

CASES: tuple[tuple[str, Mesh, int], ...] = (
    *((name, make(), count) for name, make in PATCHES.items() for count in (60, 500)),
    ("hood", hood(100, 50), 500),
    ("blade", blade(100, 50), 500),
    ("hood", hood(400, 250), 500),
    ("blade", blade(400, 250), 500),
)


def roundness(found: Figures) -> float:
    """Mean of 4 pi area / border^2: 1 for a disc, 0.79 for a square; less for jagged borders."""
    border = np.zeros(len(found.areas))
    for cell in range(len(border)):
        for line in found.outlines.of(cell):
            border[cell] += np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    return float((4.0 * math.pi * found.areas / border**2).mean())


def rows(repeats: int = 3) -> tuple[str, list[dict[str, object]]]:
    """One row for each mesh and number of cells, the best time of some repeats."""
    table: list[dict[str, object]] = []
    for name, mesh, count in CASES:
        cutting, measuring = math.inf, math.inf
        for _ in range(repeats + 1):  # the first time loads the kernels
            began = time.process_time()
            cut = cells_for(*mesh, count=count)
            cut_at = time.process_time()
            normals = np.ones((len(cut.mesh.vertices), 3))
            found = figures(cut.mesh.vertices, cut.mesh.faces, normals, cut.labels)
            measuring = min(measuring, time.process_time() - cut_at)
            cutting = min(cutting, cut_at - began)
        table.append(
            {
                "mesh": name,
                "faces": len(mesh.faces),
                "cells": count,
                "split to": len(cut.labels),
                "cut s": cutting,
                "figures s": measuring,
                "area std/mean": float(found.areas.std() / found.areas.mean()),
                "least/mean": float(found.areas.min() / found.areas.mean()),
                "roundness": roundness(found),
                "peak MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
            }
        )
    title = (
        f"Meshes cut into cells, processor time, best of {repeats}; peak memory is the whole "
        "process's up to there. Targets: 200,000 faces into 500 cells within 3 s and 1 GB, 10,000 "
        "within 0.6 s, area std/mean at most 0.2."
    )
    return title, table
