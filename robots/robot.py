"""What an arm is: a Pinocchio model of its free joints, a tool, and limits in real numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from coverable.arrays import Array, Mask
from robots.errors import RobotError
from robots.joint_selection import joint_faults, no_limit_set, numbers
from robots.pinocchio_model import TCP_FRAME, world_frame
from robots.poses import made_orthogonal, unit_axis

if TYPE_CHECKING:
    from robots.chain import Chain
    from robots.reach import ReachBound
    from robots.urdf.axes import Axis


@dataclass(frozen=True, eq=False)  # no slots: cached properties need a __dict__
class Robot:
    """A serial chain of n one-dof joints from the surface to a tool centre point (TCP).

    The root frame is the world, in which the URDF's root link is at `base`; or, where a link
    carries the surface, that link's frame (`surface_link`). The TCP is the frame of the link
    `tool_frame`, or at `tcp` in it.

    A configuration q is n real numbers, base to tip: radians for revolute and continuous joints,
    metres for prismatic ones. It is *unwrapped*: q and q + 2 pi place the arm alike, yet are two
    configurations, because cables and hard stops know the difference.

    Robots are values: they pickle (a UR5 in 20 kB), hold no geometry, and are never changed in
    place.
    """

    name: str
    model: pin.Model
    """The reduced model: the n free joints, all others locked; base and TCP are in it."""
    tool_frame: str
    """Name of the link that carries the tool."""
    approach_axis: Array
    """(3,) unit vector in the TCP's frame; it points from the tool towards the surface."""
    joint_names: tuple[str, ...]
    joint_kinds: tuple[str, ...]
    """'revolute', 'continuous' or 'prismatic', one per joint."""
    lower: Array
    """(n,) rad or m; -inf where the joint turns freely."""
    upper: Array
    """(n,) rad or m; +inf where the joint turns freely."""
    max_velocity: Array = field(default_factory=lambda: np.array(np.nan))
    """(n,) rad/s or m/s, or one for all; nan where no velocity limit is known."""
    limit_sets: Mapping[str, Array] = field(default_factory=dict)
    """Named limits, each (n, 2) rad or m, that `with_limits` knows."""
    urdf: str | None = None
    """Path of the URDF file, for the viewer; None for a robot that was built in memory."""
    package_dirs: tuple[str, ...] = ()
    """Folders in which meshes that a package names are looked up."""
    locked: Mapping[str, float] = field(default_factory=dict)
    """Every moving joint of the URDF that is not free here, with the value it is held at."""
    notes: tuple[str, ...] = ()
    """What was assumed or left out when the URDF was read."""
    reference_axis: Array = field(default_factory=lambda: np.full(3, np.nan))
    """(3,) unit vector in the TCP's frame, by which roll is measured; across `approach_axis`.

    By default +x, or +z where the approach axis is +-x; of another vector the part that is
    orthogonal to the approach axis is kept.
    """
    start: Array | None = None
    """(n,) rad or m, where the covering motion has to begin; None for anywhere."""
    surface_link: str | None = None
    """The link that carries the surface, and whose frame is the root frame; None for the world."""
    axes: tuple[Axis, ...] = ()
    """Axes that arm or surface are mounted on and that the URDF lacks, from the world outwards."""
    root_link: str = ""
    """The URDF's root link; by default the model's first."""
    xacro_args: tuple[tuple[str, object], ...] = ()
    """Arguments of a .xacro file, for reading it again."""

    def __post_init__(self) -> None:
        """Copy and write-protect the arrays, and check that they fit together."""
        n, source = len(self.joint_names), f"robot {self.name!r}"
        kept: dict[str, Any] = {
            name: numbers(getattr(self, name), f"{source}: {name}", (n,))
            for name in ("lower", "upper")
        }
        for name, limits in kept.items():
            if np.isnan(limits).any():
                raise RobotError(f"{name} holds NaN", source)
        kept |= self._unit_axes(source)
        if self.start is not None:
            kept["start"] = start = numbers(self.start, f"{source}: start", (n,))
            if not np.isfinite(start).all():
                raise RobotError(f"start must be finite, got {start.tolist()}", source)
        speeds = numbers(self.max_velocity, f"{source}: max_velocity")
        if speeds.shape not in ((), (n,)) or (speeds <= 0.0).any():
            raise RobotError(
                f"max_velocity must be {n} positive numbers (rad/s or m/s), nan where unknown; "
                f"got {speeds.tolist()}",
                source,
            )
        kept["max_velocity"] = np.broadcast_to(speeds, n)  # read-only
        sets = {
            name: numbers(table, f"{source}: limit set {name!r}", (n, 2))
            for name, table in self.limit_sets.items()
        }
        kept["limit_sets"] = MappingProxyType(sets)
        kept["locked"] = MappingProxyType(dict(self.locked))
        for name, value in kept.items():
            object.__setattr__(self, name, value)
        names, kinds = self.joint_names, self.joint_kinds
        faults = joint_faults(names, kinds, self.lower, self.upper, self.start)
        if self.model.nq != self.model.nv:
            faults.append(
                "a joint of the model has no plain value, as Pinocchio's continuous joints, which "
                "are (cos, sin); make it a JointModelRevoluteUnaligned, or use load_robot"
            )
        if faults:
            raise RobotError(faults, source)

    def _unit_axes(self, source: str) -> dict[str, Array]:
        """Both axes of the tool, of length one, the reference axis across the other."""
        names = ("approach_axis", "reference_axis")
        given = [numbers(getattr(self, name), f"{source}: {name}", (3,)) for name in names]
        approach = unit_axis(given[0])
        if np.isnan(approach).any():
            raise RobotError(
                "approach_axis must be a finite vector that is not zero, such as [0, 0, 1]; "
                f"got {given[0].tolist()}",
                source,
            )
        reference = made_orthogonal(given[1], approach)
        if np.isnan(reference).any():
            raise RobotError(
                "reference_axis must be a finite vector that is not zero and not parallel to the "
                f"approach axis {approach.tolist()}, for roll is measured by its part across it; "
                f"got {given[1].tolist()}",
                source,
            )
        approach.flags.writeable = reference.flags.writeable = False
        return {"approach_axis": approach, "reference_axis": reference}

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle as a call of the constructor (mapping proxies do not pickle)."""
        values = (getattr(self, item.name) for item in fields(self))
        plain = (dict(value) if isinstance(value, Mapping) else value for value in values)
        return Robot, tuple(plain)

    @property
    def n(self) -> int:
        """Number of free joints."""
        return len(self.joint_names)

    @property
    def prismatic(self) -> Mask:
        """(n,) True where a joint slides."""
        return np.array([kind == "prismatic" for kind in self.joint_kinds], dtype=bool)

    @cached_property
    def tool_frame_id(self) -> int:
        """Index of the frame of the TCP in `model.frames`."""
        kind = pin.FrameType.OP_FRAME
        if self.model.existFrame(TCP_FRAME, kind):
            return int(self.model.getFrameId(TCP_FRAME, kind))
        return self.tool_link_id

    @cached_property
    def tool_link_id(self) -> int:
        """Index of the frame of the link `tool_frame` in `model.frames`.

        A URDF may give a link and a joint the same name, and `getFrameId(name)` alone then refuses.
        """
        kind = pin.FrameType.BODY
        if not self.model.existFrame(self.tool_frame, kind):
            raise RobotError(f"robot {self.name!r} has no link {self.tool_frame!r} for its tool")
        return int(self.model.getFrameId(self.tool_frame, kind))

    @property
    def tcp(self) -> Array:
        """(4, 4) m, the tool centre point in the frame of the link `tool_frame`."""
        link, tcp = (
            self.model.frames[i].placement for i in (self.tool_link_id, self.tool_frame_id)
        )
        return np.array(link.actInv(tcp).homogeneous)

    @property
    def base(self) -> Array:
        """(4, 4) m, the URDF's root link in the world, with all joints at zero."""
        data = self.model.createData()
        pin.framesForwardKinematics(self.model, data, pin.neutral(self.model))
        root = self.model.getFrameId(self.root_link or self.link_names[0], pin.FrameType.BODY)
        return np.array(data.oMf[self.world_frame_id].actInv(data.oMf[root]).homogeneous)

    @property
    def world_frame_id(self) -> int:
        """Index of the frame of the world in `model.frames`; 0 where that is the root frame."""
        return world_frame(self.model)

    @property
    def link_names(self) -> tuple[str, ...]:
        """All links of the model, those on held joints too, from the root on."""
        return tuple(f.name for f in self.model.frames if f.type == pin.FrameType.BODY)

    @property
    def base_point(self) -> Array:
        """(3,) m in the root frame, on the first joint that moves: `reach` is measured from it."""
        return self._reach.origin

    def distance_from_base(self, points: ArrayLike) -> Array:
        """Distances (...) m of points (..., 3) m in the root frame from `base_point`."""
        return np.asarray(np.linalg.norm(np.asarray(points) - self.base_point, axis=-1))

    @property
    def reach(self) -> float:
        """Upper bound (m) on the distance of the tool point from `base_point`.

        See `robots.reach.reach_bound`; inf where a prismatic joint has no limits. No configuration
        inside the limits puts the tool further out.
        """
        return self._reach.radius

    @property
    def length_unit(self) -> float:
        """m, by which lengths of this arm are measured: its reach, or 1 m where it has none."""
        return self.reach if 0.0 < self.reach < np.inf else 1.0

    @cached_property
    def _reach(self) -> ReachBound:
        """The ball that the tool point cannot leave."""
        from robots.reach import reach_bound

        return reach_bound(self.model, self.tool_frame_id, self.prismatic, self.lower, self.upper)

    @cached_property
    def chain(self) -> Chain:
        """The compiled forward kinematics, compared with Pinocchio at first use.

        Raises:
            RobotError: the free joints form no serial chain, or the two differ by more than 1e-9 m
                or 1e-9 in the axis.
        """
        # Not imported above: it compiles, and whoever only replays a motion must not depend on it.
        from robots.chain import checked_chain

        return checked_chain(
            self.name,
            self.model,
            self.tool_frame_id,
            self.approach_axis,
            self.reference_axis,
            self.lower,
            self.upper,
        )

    def with_limits(self, limits: str | Mapping[str, ArrayLike] | ArrayLike) -> Robot:
        """Return the same arm with other limits.

        Args:
            limits: the name of one of `limit_sets`; or (n, 2) lower and upper, rad or m; or a
                mapping from joint names to (lower, upper) for some of the joints.

        Raises:
            RobotError: the name or a joint is unknown, the shape is wrong, or lower > upper.
        """
        if isinstance(limits, str):
            if limits not in self.limit_sets:
                raise RobotError(no_limit_set(limits, self.limit_sets), f"robot {self.name!r}")
            table = np.array(self.limit_sets[limits], dtype=float)
        elif isinstance(limits, Mapping):
            table = self._limits_by_name(limits)
        else:
            table = numbers(limits, f"limits of robot {self.name!r}")
        if table.shape != (self.n, 2):
            raise RobotError(
                f"limits must have shape ({self.n}, 2), one (lower, upper) for each of "
                f"{', '.join(self.joint_names)}; got shape {table.shape}",
                f"robot {self.name!r}",
            )
        made = replace(self, lower=table[:, 0], upper=table[:, 1])
        # The chain has no limits, and nor has the reach of joints that turn, all of them: to work
        # them out again takes longer than some searches.
        turn = ~self.prismatic & (self.lower < self.upper) & (made.lower < made.upper)
        known = ("chain", "_reach") if turn.all() else ("chain",)
        vars(made).update({name: vars(self)[name] for name in known if name in vars(self)})
        return made

    def _limits_by_name(self, limits: Mapping[str, ArrayLike]) -> Array:
        """The present limits (n, 2) with those of some joints replaced."""
        table = np.column_stack([self.lower, self.upper])
        faults = []
        for joint, pair in limits.items():
            if joint not in self.joint_names:
                faults.append(f"there is no free joint {joint!r}")
                continue
            values = numbers(pair, f"limits of joint {joint!r}")
            if values.shape != (2,):
                faults.append(f"limits of joint {joint!r} must be a pair (lower, upper)")
                continue
            table[self.joint_names.index(joint)] = values
        if faults:
            faults[0] += f"; its free joints are: {', '.join(self.joint_names)}"
            raise RobotError(faults, f"robot {self.name!r}")
        return table

    def __repr__(self) -> str:
        """One line: name, joints and tool."""
        x, y, z = (self.tcp[:3, 3].round(9) + 0.0).tolist()  # no noise of rounding, no -0
        off = f" + ({x:g}, {y:g}, {z:g}) m" if self.tool_frame_id != self.tool_link_id else ""
        seen = f", seen from {self.surface_link!r}" if self.surface_link else ""
        return f"Robot({self.name!r}, {self.n} joints, tool {self.tool_frame!r}{off}{seen})"
