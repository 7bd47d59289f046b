from .motion_replay import Replay as Replay
from .motion_replay import placements as placements
from .motion_replay import replay as replay
from .motion_replay import second_derivatives as second_derivatives
from .proof_verification import ProofCheck as ProofCheck
from .proof_verification import verify_proof as verify_proof
