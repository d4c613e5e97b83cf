"""Joints from the beam test: by the paper's method from modes, and by maximum likelihood from accelerances."""
