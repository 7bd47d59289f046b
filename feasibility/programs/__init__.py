"""Timed motions as programs of robot controllers: URScript, RAPID, KRL, FANUC's TP, INFORM."""
