"""Random scenes around a tool over one target, and poses of the tool by python-fcl: yes or no."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from built_scenes import CLEARANCE, a_plate, arm
from foreign_clearances import ForeignScene

from feasibility import Task
from feasibility.certification.collisions.inside import winding
from feasibility.certification.tool_alone import PoseCheck, never_clear
from feasibility.collisions import Bodies, Collision, Obstacle, ToolShape, gather
from feasibility.roadmap.tool_alone import ToolAlone, ToolBlocked
from robots import Robot, load_robot
from robots.shapes import Triangles, checked_triangles
from surfaces import Cells, Surface, plane

UR5: Robot = load_robot("ur5")
CELLS: Cells = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0.0, 0.0, 0.3)).cells(1, 1)


@dataclass(frozen=True)
class Over:
    """A tool over one cell."""

    robot: Robot
    surface: Surface
    task: Task
    point: np.ndarray
    approach: np.ndarray

    @classmethod
    def cell(cls, robot: Robot, cells: Cells, task: Task, cell: int = 0) -> Over:
        targets = task.targets(cells)
        return cls(robot, cells.surface, task, targets.points[cell], targets.approaches[cell])

    @property
    def bodies(self) -> Bodies:
        found = gather(self.robot, self.surface, self.task.collision, self.task.standoff)
        assert found is not None
        return found

    def claimed(self) -> ToolBlocked | None:
        """What the search says."""
        task = self.task
        alone = ToolAlone(self.robot, self.bodies, task.cone, task.effective_tolerance)
        return alone.blocking(self.point, self.approach)

    def confirmed(self) -> PoseCheck:
        """What the verifier says."""
        task = self.task
        numbers = task.cone, task.effective_tolerance
        return never_clear(self.robot, self.bodies, *numbers, self.point, self.approach)

    def clear_pose(self, count: int, rng: np.random.Generator) -> bool:
        """Is one of so many random poses inside cone and tolerance clear of all that is at rest?"""
        scene = ToolPoses(self.robot, self.bodies)
        frame = self.robot.model.frames[self.robot.tool_frame_id].placement
        axis = frame.rotation @ self.robot.approach_axis
        onto = pin.Quaternion.FromTwoVectors(axis, self.approach).toRotationMatrix()
        for k in range(count):
            tilt = np.cross(self.approach, rng.normal(size=3))
            # Many at the border of the cone, where there is most room.
            angle = self.task.cone * (1.0 if k % 2 else np.sqrt(rng.uniform()))
            tilt *= angle / np.linalg.norm(tilt)
            turn = pin.exp3(tilt) @ pin.exp3(rng.uniform(-np.pi, np.pi) * self.approach) @ onto
            off = rng.normal(size=3)
            off *= self.task.effective_tolerance * rng.uniform() ** 0.1 / np.linalg.norm(off)
            if scene.clear(pin.SE3(turn, self.point + off - turn @ frame.translation)):
                return True
        return False


class ToolPoses(ForeignScene):
    """The tool among what is at rest, for fcl."""

    def __init__(self, robot: Robot, bodies: Bodies) -> None:
        super().__init__(robot, bodies)
        joint = {owner: entries[0][0] for owner, entries in self.objects.items()}
        self.asked = [
            k
            for k, pair in enumerate(bodies.pairs)
            if sorted((joint[pair.first], joint[pair.second])) == [0, robot.n]
        ]
        self.clearances = np.array([bodies.pairs[k].clearance for k in self.asked])
        meshes = [one for one in bodies.scene if isinstance(one.geometry, Triangles)]
        self.solid_meshes = [one for one in meshes if one.geometry.closed]
        self.last = robot.n

    def clear(self, pose: pin.SE3) -> bool:
        """Is no pair too near? Of meshes, fcl knows the triangles: what is inside is asked for."""
        self.data.oMi[self.last] = pose
        pairs = [self.bodies.pairs[k] for k in self.asked]
        for mesh in self.solid_meshes:
            triangles = mesh.geometry.vertices[mesh.geometry.faces]
            for solid in self.bodies.solids:
                named = any({solid.owner, mesh.name} == {p.first, p.second} for p in pairs)
                if solid.joint != self.last or not named:
                    continue
                middle = pose.act(np.asarray(solid.placement)[:3, 3])
                if isinstance(solid.geometry, Triangles):
                    middle = pose.homogeneous @ solid.placement
                    corner = solid.geometry.vertices[solid.geometry.faces[0, 0]]
                    middle = middle[:3, :3] @ corner + middle[:3, 3]
                own = (middle - mesh.placement[:3, 3]) @ mesh.placement[:3, :3]
                if abs(winding(triangles, own)) > 0.5:
                    return False
        return bool((self._at_rest() >= self.clearances).all())

    def _at_rest(self) -> np.ndarray:
        found = []
        for k in self.asked:
            pair, least = self.bodies.pairs[k], np.inf
            for one in self.objects[pair.first]:
                for other in self.objects[pair.second]:
                    least = min(least, self._apart(one, other))
            found.append(least)
        return np.array(found)

    def _apart(self, one, other):  # type: ignore[no-untyped-def]
        """m; an overlap is less than any clearance."""
        import fcl

        first, second = self._placed(one), self._placed(other)
        if fcl.collide(first, second, fcl.CollisionRequest(), fcl.CollisionResult()):
            return -1.0 - one[3] - other[3]
        distance = fcl.distance(first, second, fcl.DistanceRequest(), fcl.DistanceResult())
        return distance - one[3] - other[3]


def bracket() -> Triangles:
    """An L of 0.2 m: not convex."""
    ell = np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.05], [0.05, 0.05], [0.05, 0.2], [0.0, 0.2]])
    bottom, top = (np.column_stack([ell, np.full(6, z)]) for z in (0.0, 0.1))
    caps = [[0, 3, 1], [1, 3, 2], [0, 4, 3], [0, 5, 4]]
    upper = [[a + 6, c + 6, b + 6] for a, b, c in caps]
    walls = [[k, (k + 1) % 6, (k + 1) % 6 + 6] for k in range(6)]
    walls += [[k, (k + 1) % 6 + 6, k + 6] for k in range(6)]
    return checked_triangles(np.vstack([bottom, top]), np.array(caps + upper + walls))


def random_object(rng: np.random.Generator, name: str, around: np.ndarray) -> Obstacle:
    """A body of a size of 5 to 30 cm near a place."""
    place = {
        "position": tuple(around + rng.uniform(-0.15, 0.15, 3)),
        "rpy_deg": tuple(rng.uniform(-180.0, 180.0, 3)),
    }
    size = rng.uniform(0.05, 0.3, 3).tolist()
    match int(rng.integers(5)):
        case 0:
            return Obstacle.box(name, size, **place)
        case 1:
            return Obstacle.cylinder(name, size[0] / 2, size[1], **place)
        case 2:
            return Obstacle.sphere(name, size[0] / 2, place["position"])
        case 3:
            return Obstacle.capsule(name, size[0] / 2, size[1], **place)
    return Obstacle.halfspace(name, **place)


def random_tool(rng: np.random.Generator) -> ToolShape:
    """A shape behind the tool point."""
    shapes = [
        ToolShape.cylinder(0.01, 0.1, position=(0.0, 0.0, -0.05)),
        ToolShape.box((0.03, 0.02, 0.1), position=(0.01, 0.0, -0.05)),
        ToolShape.capsule(0.015, 0.08, position=(0.0, 0.0, -0.06)),
        ToolShape.sphere(0.04, position=(0.0, 0.0, -0.05)),
    ]
    return shapes[int(rng.integers(len(shapes)))]


def random_over(seed: int) -> Over:
    """One or two objects near the target, and a tool of one shape; links are left out."""
    rng = np.random.default_rng(seed)
    around = np.array([0.5, 0.0, 0.37])
    scene = tuple(random_object(rng, f"object{k}", around) for k in range(rng.integers(1, 3)))
    asked = Collision(
        self_=False, surface=False, clearance=float(rng.choice([0.0, 0.01])), scene=scene,
        tool=(random_tool(rng),),
        allow=tuple((name, one.name) for name in UR5.link_names for one in scene),
    )  # fmt: skip
    task = Task(0.02, float(rng.uniform(1.0, 90.0)), 0.001, collision=asked)
    return Over.cell(UR5, CELLS, task)


def planted_over(name: str, seed: int) -> Over | None:
    """A pose that an arm gets to, and a target that it covers, among objects; None if it collides.

    The target is off the tool point by up to the tolerance, and the axis by up to the cone.
    """
    rng, robot = np.random.default_rng([seed, 1]), arm(name)
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    data, model = robot.model.createData(), robot.model
    pin.framesForwardKinematics(
        model, data, pin.integrate(model, pin.neutral(model), rng.uniform(low, high))
    )
    tool = data.oMf[robot.tool_frame_id]
    tilt = np.cross(tool.rotation @ robot.approach_axis, rng.normal(size=3))
    cone_deg = float(rng.uniform(1.0, 60.0))
    tilt *= np.radians(cone_deg) * rng.uniform() / np.linalg.norm(tilt)
    off = rng.normal(size=3)
    off *= 0.001 * rng.uniform() / np.linalg.norm(off)
    around = tool.translation
    scene = tuple(random_object(rng, f"object{k}", around) for k in range(rng.integers(1, 4)))
    asked = Collision(surface=False, clearance=float(rng.choice([0.0, 0.005])), scene=scene)
    task = Task(0.02, cone_deg, 0.001, collision=asked)
    approach = pin.exp3(tilt) @ tool.rotation @ robot.approach_axis
    over = Over(robot, CELLS.surface, task, around + off, approach)
    joint = model.frames[robot.tool_frame_id].parentJoint
    return over if ToolPoses(robot, over.bodies).clear(data.oMi[joint]) else None


def with_an_object_over_a_cell(name: str, seed: int) -> tuple[Robot, Cells, Task, int]:
    """A plate before an arm, and a body around the target of one of its cells."""
    rng, robot = np.random.default_rng([seed, 2]), arm(name)
    cells, task = a_plate(rng, robot)
    cell = int(rng.integers(len(cells)))
    place = task.targets(cells).points[cell] + rng.uniform(-0.02, 0.02, 3)
    size, turn = rng.uniform(0.1, 0.2, 3).tolist(), tuple(rng.uniform(-180.0, 180.0, 3))
    kinds = (
        Obstacle.box("thing", size, place, turn),
        Obstacle.sphere("thing", 0.5 * size[0], place),
        Obstacle.capsule("thing", 0.5 * size[0], size[1], place, turn),
        Obstacle.cylinder("thing", 0.5 * size[0], size[1], place, turn),
    )
    scene = (kinds[int(rng.integers(len(kinds)))],)
    return robot, cells, replace(task, collision=Collision(clearance=CLEARANCE, scene=scene)), cell
