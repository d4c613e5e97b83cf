"""The suspended bar, a test of its own: its damping, and what its frequencies say of material and size."""
