"""One case for several arms: a study over robots."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

from coverable.errors import Fault
from feasibility.cases.case import Case
from feasibility.cases.collision_table import CollisionPart
from feasibility.cases.robot_table import is_urdf
from feasibility.cases.table_reader import CaseError, absolute
from feasibility.cases.toml import as_read
from feasibility.search_settings import Progress
from feasibility.studies.built_cases import arm_of, case_of
from feasibility.studies.combinations import tasks_of
from feasibility.studies.pool import Workers
from feasibility.studies.run import run_tasks
from feasibility.studies.study_outcome import finite, merit
from feasibility.studies.varied_keys import Variation, VariedKey


@dataclass(frozen=True, slots=True)
class Arm:
    """What one arm can do about the surface; the defaults are those of an arm whose task failed."""

    robot: str
    """As it was named: two files may hold arms of the same name."""
    joints: int
    reach_m: float | None
    """Upper bound on the distance of the tool from the first joint; None where there is none."""
    verdict: str
    """'feasible', 'infeasible' or 'undecided'."""
    evidence: str
    message: str
    share: float = 0.0
    """Of the area, 0..1, that the best single motion covers."""
    covered: int = 0
    """Cells of it."""
    cells: int = 0
    cause: str | None = None
    """The most frequent cause of missed cells; None without any."""
    patches: int | None = None
    """Continuous motions that together cover all that can be covered; None where that is not known,
    as of surfaces with more than 400 cells."""
    patches_share: float | None = None
    """Of the area, 0..1, that these cover together."""
    critical_cone_deg: float | None = None
    """The smallest cone with a covering motion, to half a degree; narrower ones than
    `LEAST_CONE_DEG` are not tested. None where there is none, or it was not requested."""
    margins: dict[str, float | None] | None = None
    """What the covering motion leaves: limit_deg, limit_m, cone_deg, reach_m, placement_m."""
    unchecked_links: Sequence[str] = ()
    """What has no body, where collisions are checked; see `Verdict`."""
    seconds: float = 0.0
    """Time that the work took."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """Arms in the order in which they were named."""

    case: str
    arms: tuple[Arm, ...]
    critical: bool
    """Were critical cones searched for?"""
    collision: CollisionPart | None = None
    """What was checked of collisions; None where nothing was."""

    @property
    def ranked(self) -> tuple[Arm, ...]:
        """The best first: feasible ones by their margin to the limits, the others by share."""
        return tuple(sorted(self.arms, key=lambda arm: merit(asdict(arm))))


def compare(
    case: Case,
    robots: Sequence[str],
    workers: Workers,
    critical: bool = False,
    progress: Progress | None = None,
) -> Comparison:
    """The same case for several arms, each mounted where the case's arm is: on its base and axes.

    Args:
        case: surface, task and search; its own arm keeps its limits and tool if it is among the
            robots.
        robots: names of the library, and paths of URDF or xacro files.
        workers, progress: as for `run_tasks`.
        critical: look for the smallest cone that each arm can do with; some ten verdicts each.

    Raises:
        CaseError: an arm cannot be loaded, or is named twice; all of them together.

    Example:
        >>> from coverable import load_case
        >>> from coverable import open_workers
        >>> with open_workers(0) as workers:
        ...     found = compare(load_case("paper/4a"), ["puma560", "ur5"], workers)
        >>> [(arm.robot, arm.verdict) for arm in found.ranked]
        [('puma560', 'feasible'), ('ur5', 'infeasible')]
    """
    base = as_read(case.to_tables())
    if case.search.method != "complete":
        kept = ("seed", "time_limit", "evaluations")
        base["search"] = {key: base["search"][key] for key in kept if key in base["search"]}
    tables = [{"urdf": absolute(name)} if is_urdf(name) else {"name": name} for name in robots]
    own = base["robot"]
    mounted = tuple(own if table.items() <= own.items() else table for table in tables)
    faults = [
        Fault(f"--robots[{k}]", f"{name!r} is named twice")
        for k, name in enumerate(robots)
        if name in robots[:k]
    ]
    if not robots:
        faults.append(Fault("--robots", "is empty; expected such as ur5,panda,my_arm.urdf"))
    varied = VariedKey("robot", "--robots", ("robot",), mounted)
    found = tasks_of(base, Variation((varied,)), None, faults)
    if faults:
        raise CaseError(faults, case.name)
    wanted = {"wanted": {"patches": True, "critical": critical}}
    tasks = [
        replace(task, tables={**task.tables, **wanted}, parameters={"robot": name})
        for task, name in zip(found, robots, strict=True)
    ]
    rows, arms = run_tasks(tasks, workers, progress=progress), []
    for task, row in zip(tasks, rows, strict=True):
        robot, result = arm_of(case_of(task.tables)), row.result
        named = {key: result[key] for key in Arm.__dataclass_fields__ if key in result}
        arms.append(
            Arm(
                **task.parameters, **named, joints=robot.n, reach_m=finite(robot.reach),
                cause=next(iter(result.get("causes", {})), None), seconds=row.seconds,
            )
        )  # fmt: skip
    return Comparison(case.name, tuple(arms), critical, case.collision)
