from .arm_collisions import ArmCheck as ArmCheck
from .arm_collisions import ArmCollisions as ArmCollisions
from .proof_verification import ProofCheck as ProofCheck
from .proof_verification import verify_proof as verify_proof
