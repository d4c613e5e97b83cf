"""Commissioning: examinations of the rig, their signed records, and warnings before a run."""
