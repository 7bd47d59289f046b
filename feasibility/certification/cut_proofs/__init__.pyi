from .proof_verification import ProofCheck as ProofCheck
from .proof_verification import verify_proof as verify_proof
