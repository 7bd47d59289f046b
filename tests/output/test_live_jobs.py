"""Of each page the newest question alone is answered, and pages do not mix."""

import threading
from types import SimpleNamespace

import pytest

from feasibility.live.jobs import ALONE, Job, Superseded
from feasibility.live.sessions import LEASE, MOST, Gone, Sessions, TooManyPages

GUARD_S = 1800.0


class Worker:
    """Answers with the values once it is let go on, and gives up a job that is dropped by then."""

    def __init__(self):
        self.begun, self.given_up = [], []
        self.go, self.started = threading.Semaphore(0), threading.Semaphore(0)

    def __call__(self, job):
        self.begun.append(job.values)
        self.started.release()
        assert self.go.acquire(timeout=GUARD_S)
        if job.dropped:
            self.given_up.append(job.values)
            raise Superseded
        return {"of": job.values}

    def let(self, count=1):
        self.go.release(count)

    def wait_for(self):
        assert self.started.acquire(timeout=GUARD_S)


@pytest.fixture
def worker():
    return Worker()


@pytest.fixture
def sessions(worker):
    found = Sessions(worker)
    yield found
    found.close_all()
    worker.let(100)


def answer(job):
    assert job.wait(GUARD_S)
    return job.answer


def test_superseded_questions_are_given_up_and_never_answered(sessions, worker):
    page = sessions.open()
    first = sessions.ask(page, 1, False, "a")
    worker.wait_for()
    second = sessions.ask(page, 2, False, "b")  # waits behind the first
    third = sessions.ask(page, 3, False, "c")  # replaces it
    for job in (first, second):  # whoever waits hears at once
        assert (job.wait(0), job.dropped) == (True, True)
    worker.let(2)
    assert answer(third) == {"of": "c"}
    assert worker.begun == ["a", "c"]  # nobody began the second one
    assert worker.given_up == ["a"]
    assert (first.answer, second.answer) == (None, None)


def test_the_same_number_is_the_same_question_and_an_older_one_is_too_late(sessions, worker):
    page = sessions.open()
    job = sessions.ask(page, 5, True, "now")
    assert sessions.ask(page, 5, True, "now") is job
    late = sessions.ask(page, 4, True, "before")
    assert (late.dropped, late.wait(0)) == (True, True)
    worker.let()
    assert answer(job) == {"of": "now"}
    assert worker.begun == ["now"]


def test_two_pages_do_not_mix(sessions, worker):
    one, other = sessions.open(), sessions.open()
    assert one != other
    first = sessions.ask(one, 7, False, "one")
    second = sessions.ask(other, 1, False, "other")  # a smaller number of another page
    worker.let(2)
    assert (answer(first), answer(second)) == ({"of": "one"}, {"of": "other"})
    sessions.close(one)
    assert not second.dropped
    with pytest.raises(Gone):
        sessions.ask(one, 8, False, "late")
    third = sessions.ask(other, 2, False, "again")
    worker.let()
    assert answer(third) == {"of": "again"}


def test_a_quick_look_does_not_wait_and_a_page_that_is_closed_frees_its_place(sessions, worker):
    pages = [sessions.open() for _ in range(MOST)]
    with pytest.raises(TooManyPages):
        sessions.open()
    certified = sessions.ask(pages[0], 1, True, "slow")
    worker.wait_for()
    quick = sessions.ask(pages[1], 1, False, "quick")
    worker.wait_for()  # both are under way
    assert worker.begun == ["slow", "quick"]
    sessions.close(pages[0])
    assert (certified.dropped, certified.wait(0)) == (True, True)
    sessions.close(pages[0])  # twice does no harm
    assert len(sessions) == MOST - 1
    sessions.open()
    worker.let(2)
    assert answer(quick) == {"of": "quick"}


def test_pages_that_say_nothing_any_more_are_forgotten():
    time = [0.0]
    sessions = Sessions(lambda job: {}, now=lambda: time[0])
    pages = [sessions.open() for _ in range(MOST)]
    time[0] = 0.6 * LEASE
    sessions.beat(pages[1])
    sessions.ask(pages[2], 1, False, None)
    time[0] = 1.2 * LEASE
    sessions.open()
    assert len(sessions) == 3
    for gone in (pages[0], *pages[3:]):
        with pytest.raises(Gone):
            sessions.beat(gone)
    sessions.beat(pages[1])
    sessions.beat(pages[2])
    sessions.close_all()


def test_an_answer_that_nobody_asks_for_any_more_is_given_up(monkeypatch):
    clock = [100.0]
    told = SimpleNamespace(monotonic=lambda: clock[0])
    monkeypatch.setattr("feasibility.live.jobs.time", told)
    job = Job("page", 1, True, None)
    clock[0] += 0.9 * ALONE
    assert not job.dropped
    job.finish({})
    assert job.wait(0)
    clock[0] += 0.9 * ALONE
    assert not job.dropped
    clock[0] += 0.2 * ALONE
    assert job.dropped
