"""Branch and bound over joint boxes: what proofs that the arm cannot do something are made of."""
