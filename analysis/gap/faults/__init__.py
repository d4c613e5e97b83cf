"""Faults of a measurement itself, which are found and taken out before any effect is looked for."""
