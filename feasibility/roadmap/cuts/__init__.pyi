from .gaps import Component as Component
from .guess import Blocked as Blocked
from .known import components_of as components_of
from .places import places_on as places_on
from .prover import Attempt as Attempt
from .prover import Prover as Prover
