"""Fits of the simulation to measurements: likelihood, noise, scales, and predictions of data that were left out."""
