"""Results of a run for other programs, written only: one description of them, and a writer for each format."""
