"""The question: can this arm cover this surface in one continuous motion?

>>> from coverable import load_robot
>>> from coverable import sphere
>>> from coverable import Task, check
>>> puma = load_robot("puma560", limits="set-1")
>>> dome = sphere(radius=1.0, polar_deg=(10, 90), azimuth_deg=(10, 180), side="inside")
>>> verdict = check(puma, dome.cells(9, 10), Task(standoff=0.005, cone_deg=45))
>>> verdict.feasible, verdict.n_covered, verdict.n_edges
(True, 90, 305)

How a verdict comes about; wherever a step has a number, it is one of these.

1. `cases/case.py` reads the case: arm, cells and task. Every fault is named, with its place.
2. `checking.py` makes the problem (`problem.py`), with its bodies and the pairs that have to stay
   apart (`collisions/gathering.py`). Search and judge share these values, and no code.
3. The task says where the tool has to be: eqs. (1) and (3) in `task.py`, the cone, eq. (4), in
   `cone.py`, the roll, eqs. (2) and (6), in `roll.py`; between two cells, `targets/curves.py`.
4. `attempts.py` calls a method: that of the paper (`paper/greedy.py`, Algorithm 2 over 1), or the
   complete one, steps 5 to 9; again with a narrower task where step 10 narrowly refuses its motion.
5. `roadmap/complete.py` hands arm, curves and bodies to the compiled kernels as arrays
   (`roadmap/motions/search_arrays.py`).
6. Guesses over a cell in the middle (`roadmap/search.py`) are projected onto eqs. (5) to (7)
   (`roadmap/motions/projection.py`) and pushed clear (`roadmap/moving_clear.py`). From each a
   component grows over the surface (`roadmap/expansion.py`) along motions
   (`roadmap/motions/tracking.py`), each of whose segments is certified
   (`roadmap/motions/segment_bound.py`, `collisions/kernels/segments.py`). Mostly that is all.
7. `roadmap/rounds.py`: cells that nothing reaches are seeded, or proved uncoverable
   (`roadmap/rulings.py`): by branch and bound (`roadmap/proofs/branching.py`), and with bodies by
   the judge (`certification/collisions/everywhere.py`), which `roadmap/blockers.py` asks.
8. Rounds of more guesses, self-motions and bridges (`roadmap/connecting.py`); where they gain
   nothing, a proof by cuts (`roadmap/proving.py`), finer cells (`roadmap/refinement.py`).
9. One component over all cells becomes one motion (`roadmap/walk.py`).
10. Pinocchio replays it over the surface itself, between waypoints too
    (`certification/motion_replay.py`), and coal its bodies (`certification/collisions/`).
11. `checking.py` words the answer (`verdict.py`). What else is demanded
    (`demands/every_demand.py`) is judged last, as speeds in `certification/rate_replay.py`; what
    nobody judged makes the answer undecided.
12. `reports/verdict.py` prints it, or `reports/verdict_json.py`; graph G (`roadmap/complete.py`)
    and the cause of each missed cell (`roadmap/causes/diagnosis.py`) are made when first read.
"""
