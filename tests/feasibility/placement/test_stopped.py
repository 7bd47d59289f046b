"""A search for placements that is stopped: the best so far is its answer, and says so."""

from __future__ import annotations

import signal

import pytest
from placement_cases import placement_case
from small_cases import TEXTS

from feasibility import Answer, check
from feasibility.cli.main import main
from feasibility.clock import Clock
from feasibility.placement import LocalEvaluator, Placements, Pose, Region, StudyEvaluator, place
from feasibility.placement.region import moved_cells

STOPPED = {"ctrl-c": "it was interrupted", "late": "the time limit ran out"}
ENOUGH = 20  # placements


class Stopping(LocalEvaluator):
    """Tries some placements; then there is a Ctrl-C, or the time is up."""

    how, clock, tried = "", Clock(), 0

    def try_at(self, pose, early=True):
        self.tried += 1
        if self.tried > ENOUGH and self.how == "ctrl-c":
            raise KeyboardInterrupt
        if self.tried > ENOUGH:
            self.clock.limit = 1e-9
        return super().try_at(pose, early)


def stopped(how: str, said: list[str], **more: bool) -> Placements:
    setup = placement_case("ur5 plate").build()
    region = Region.around(Pose.of_surface(setup.cells.surface), {"x": (0.0, 0.3)})
    evaluator = Stopping(*setup)
    evaluator.how, evaluator.clock = how, Clock(3600.0).start()

    def progress(done: int, total: int | None, text: str) -> None:
        assert total is not None
        said.append(text)

    return place(
        *setup[:3], region, setup.search, evaluator=evaluator, clock=evaluator.clock,
        progress=progress, **more,
    )  # fmt: skip


@pytest.mark.parametrize("how", STOPPED)
def test_the_best_so_far_is_the_answer(how: str) -> None:
    said: list[str] = []
    found = stopped(how, said, interruptible=True)
    assert (found.answer, found.interrupted) == (Answer.FEASIBLE, how == "ctrl-c")
    assert found.message.endswith(f"this is the best so far: {STOPPED[how]}.")
    assert found.best.margin == max(trial.margin for trial in found.trials) > 0.0
    assert len(found.trials) > ENOUGH // 2
    assert check(found.robot, moved_cells(found.cells, found.best.pose), found.task).feasible
    assert said[0] == "trying placements"
    assert said[-1].startswith("trying placements; best covers all, margin 0.")


def test_in_python_a_ctrl_c_is_raised() -> None:
    with pytest.raises(KeyboardInterrupt):
        stopped("ctrl-c", [])


@pytest.mark.parametrize(("name", "status"), [("try_all", 130), ("check_all", 130)])
def test_the_command_prints_what_it_has(name, status, tmp_path, capsys, monkeypatch) -> None:
    """The second batch of tries, or the last checks, are interrupted."""
    plain, calls = getattr(StudyEvaluator, name), []

    def interrupted(self, *args):
        calls.append(args)
        if len(calls) == 2:
            signal.raise_signal(signal.SIGINT)
        return plain(self, *args)

    monkeypatch.setattr(StudyEvaluator, name, interrupted)
    case, page = tmp_path / "case.toml", tmp_path / "where.html"
    case.write_text(TEXTS["plate"])
    where = ["--x", "0.3", "0.4", "--count", "12", "--html", str(page), "--workers", "0"]
    assert main(["place", str(case), *where]) == status
    out, err = capsys.readouterr()
    assert out.startswith("feasible: the surface can be covered in one motion at the placements")
    assert "this is the best so far: it was interrupted." in " ".join(out.split())
    assert "the best as a case: --set" in out
    assert err.endswith(f"nothing written to --html: {page}\ncoverable: interrupted\n")
    assert not page.exists()
