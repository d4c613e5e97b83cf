"""Rows of what was computed: analyses, modes, joints, stiffness, comparisons and diagnoses."""
