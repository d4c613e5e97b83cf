"""Runs between the catalogue and the rig: their orders, and their records as rows."""
