"""The question: can this arm cover this surface in one continuous motion?

>>> from robots import load_robot
>>> from surfaces import sphere
>>> from feasibility import Task, check
>>> puma = load_robot("puma560", limits="set-1")
>>> dome = sphere(radius=1.0, polar_deg=(10, 90), azimuth_deg=(10, 180), side="inside")
>>> verdict = check(puma, dome.cells(9, 10), Task(standoff=0.005, cone_deg=45))
>>> verdict.feasible, verdict.n_covered, verdict.n_edges
(True, 90, 305)
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
