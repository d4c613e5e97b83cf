"""The test of the suspended beam: its damping, material and dimensions from its free modes."""
