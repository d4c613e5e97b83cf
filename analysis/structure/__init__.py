"""The beam and what holds it: elements, joints, their assembly, and what it does: modes and accelerances."""
