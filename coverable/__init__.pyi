"""Every public name, and the module that has it: read by `__getattr__`, and by type checkers."""

import feasibility.paths.coverage
import feasibility.reports.comparison
import feasibility.reports.division
import feasibility.reports.explanation
import feasibility.reports.path
import feasibility.reports.placement
import feasibility.reports.study
from coverable.errors import ArgumentError as ArgumentError
from coverable.errors import CoverableError as CoverableError
from feasibility.cases.case import Case as Case
from feasibility.cases.case import builtin_cases as builtin_cases
from feasibility.cases.case import load_case as load_case
from feasibility.cases.table_reader import CaseError as CaseError
from feasibility.certification.motion_replay import replay as replay
from feasibility.checking import check as check
from feasibility.checking import greedy_check as greedy_check
from feasibility.collisions.scene import Obstacle as Obstacle
from feasibility.collisions.scene import ToolShape as ToolShape
from feasibility.collisions.settings import Collision as Collision
from feasibility.demands.area import TreatedArea as TreatedArea
from feasibility.demands.treated_words import treated_words as treated_words
from feasibility.division.division import Division as Division
from feasibility.division.pass_planning import PlannedPasses as PlannedPasses
from feasibility.division.pass_planning import plan_best_passes as plan_best_passes
from feasibility.division.pass_planning import plan_passes as plan_passes
from feasibility.division.pass_runs import PassRuns as PassRuns
from feasibility.division.pass_runs import pass_runs as pass_runs
from feasibility.division.surface_division import divide as divide
from feasibility.live.serving import Live as Live
from feasibility.live.serving import live as live
from feasibility.paper.literal import LiteralSearch as LiteralSearch
from feasibility.paper.starts import starts as starts
from feasibility.paths.coverage import CoveragePath as CoveragePath
from feasibility.paths.coverage import coverage_path as coverage_path
from feasibility.paths.order import PathError as PathError
from feasibility.placement.map import placement_map as placement_map
from feasibility.placement.placements import Placements as Placements
from feasibility.placement.placements import place as place
from feasibility.placement.region import Pose as Pose
from feasibility.placement.region import Region as Region
from feasibility.placement.stations import station_plan as station_plan
from feasibility.placement.trials import evaluator_here as evaluator_here
from feasibility.programs.controller_axes import ProgramSettings as ProgramSettings
from feasibility.programs.writing import save_program as save_program
from feasibility.reports.placement import settings_of as settings_of
from feasibility.results.motion_file import load_motion as load_motion
from feasibility.results.result_file import load_result as load_result
from feasibility.results.result_file import save_result as save_result
from feasibility.results.trajectory_files import load_trajectory as load_trajectory
from feasibility.results.trajectory_files import save_trajectory as save_trajectory
from feasibility.search_settings import Search as Search
from feasibility.sensitivity.explanation import explain as explain
from feasibility.sensitivity.thresholds import Explanation as Explanation
from feasibility.studies.file import Study as Study
from feasibility.studies.file import load_study as load_study
from feasibility.studies.file import read_study as read_study
from feasibility.studies.robot_comparison import Comparison as Comparison
from feasibility.studies.robot_comparison import compare as compare
from feasibility.studies.run import run_tasks as run_tasks
from feasibility.studies.store import Store as Store
from feasibility.studies.workers import open_workers as open_workers
from feasibility.task import Task as Task
from feasibility.timing.path_timing import trajectory as trajectory
from feasibility.timing.sampled_trajectory import Trajectory as Trajectory
from feasibility.timing.speed_limits import motion_limits as motion_limits
from feasibility.verdict import Answer as Answer
from feasibility.verdict import Cause as Cause
from feasibility.verdict import CauseKind as CauseKind
from feasibility.verdict import Evidence as Evidence
from feasibility.verdict import Verdict as Verdict
from feasibility.verifying import Verification as Verification
from feasibility.verifying import verify as verify
from feasibility.viewer.figures import Plot as Plot
from feasibility.viewer.figures import plot_causes as plot_causes
from feasibility.viewer.figures import plot_graph as plot_graph
from feasibility.viewer.figures import plot_map as plot_map
from feasibility.viewer.figures import plot_sides as plot_sides
from feasibility.viewer.figures import plot_transition as plot_transition
from feasibility.viewer.figures import unrolled_edges as unrolled_edges
from feasibility.viewer.pass_view import view_passes as view_passes
from feasibility.viewer.path_and_division import view_division as view_division
from feasibility.viewer.path_and_division import view_path as view_path
from feasibility.viewer.placement_view import view_placements as view_placements
from feasibility.viewer.placement_view import view_study as view_study
from feasibility.viewer.view_figures import plot_view as plot_view
from feasibility.viewer.view_figures import plot_views as plot_views
from feasibility.viewer.viewer import View as View
from feasibility.viewer.viewer import show as show
from feasibility.viewer.viewer import view as view
from robots.as_yourdfpy import as_yourdfpy as as_yourdfpy
from robots.errors import RobotError as RobotError
from robots.known_arms import list_robots as list_robots
from robots.library import load_robot as load_robot
from robots.robot import Robot as Robot
from robots.urdf.axes import Axis as Axis
from surfaces.cells import Cells as Cells
from surfaces.fitted.bspline import bspline as bspline
from surfaces.fitted.control_net_file import read_net as read_net
from surfaces.fitted.formula import parametric as parametric
from surfaces.fitted.grid_file import read_grid as read_grid
from surfaces.fitted.point_grid import grid as grid
from surfaces.meshes.mesh_surface import MeshSurface as MeshSurface
from surfaces.meshes.mesh_surface import mesh as mesh
from surfaces.meshes.selection import cut_box as cut_box
from surfaces.meshes.selection import cut_plane as cut_plane
from surfaces.meshes.selection import faces_within_cone as faces_within_cone
from surfaces.meshes.selection import take_faces as take_faces
from surfaces.meshes.step_surface import step as step
from surfaces.meshes.step_surface import step_faces as step_faces
from surfaces.meshes.triangle_mesh import TriangleMesh as TriangleMesh
from surfaces.passes.parallel import parallel_passes as parallel_passes
from surfaces.passes.toolpath import pass_toolpath as pass_toolpath
from surfaces.patches.cone import cone as cone
from surfaces.patches.cylinder import cylinder as cylinder
from surfaces.patches.ellipsoid import ellipsoid as ellipsoid
from surfaces.patches.hyperboloid import hyperboloid as hyperboloid
from surfaces.patches.patch import Patch as Patch
from surfaces.patches.plane import plane as plane
from surfaces.patches.revolution import revolution as revolution
from surfaces.patches.sphere import sphere as sphere
from surfaces.patches.torus import torus as torus
from surfaces.piecewise.piecewise_surface import Piecewise as Piecewise
from surfaces.piecewise.piecewise_surface import piecewise as piecewise
from surfaces.surface import Surface as Surface
from surfaces.surface import SurfaceError as SurfaceError
from surfaces.toolpaths.given import poses as poses
from surfaces.toolpaths.pose_file import read_poses as read_poses

comparison_text = feasibility.reports.comparison.as_text
division_text = feasibility.reports.division.as_text
explanation_text = feasibility.reports.explanation.as_text
path = feasibility.paths.coverage.coverage_path
path_text = feasibility.reports.path.as_text
placement_text = feasibility.reports.placement.as_text
study_text = feasibility.reports.study.as_text
__version__: str
