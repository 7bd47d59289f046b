from .gaps import Component as Component
from .gaps import components_of as components_of
from .guess import OpenGap as OpenGap
from .places import places_on as places_on
from .prover import ProofAttempt as ProofAttempt
from .prover import Prover as Prover
