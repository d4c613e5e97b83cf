"""A run as files of other programs: one description of its results, and a writer for each form."""
