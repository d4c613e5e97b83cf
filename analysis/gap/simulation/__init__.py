"""The simulation of both rigs with its derivatives: the paper's model, its tolerances, and effects on top of it."""
