"""The complete search: a roadmap of certified motions, proofs of infeasibility, and causes."""
