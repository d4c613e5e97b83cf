"""The evidence of fitted models of any structure, and the verdict that follows from it."""
