from .over_cells import Blockers as Blockers
from .over_cells import blockers_of as blockers_of
from .prover import ArmBlocked as ArmBlocked
from .prover import JointBoxes as JointBoxes
