"""The judge of speeds and of the distance from singularities, between waypoints too."""
