"""Cut proofs: no single motion covers every cell. Trees of cuts are guessed, and then proved."""
