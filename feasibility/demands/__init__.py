"""What a case demands beside the motion: a speed, a treated area; and the list of all demands."""
