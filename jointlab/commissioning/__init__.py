"""Commissioning: examinations of the rig, their signed records, and what is to be said before a run."""
