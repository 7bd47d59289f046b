"""Motions over a toolpath in its order: forward only, with changes of posture in place."""
