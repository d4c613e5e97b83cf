"""A run: its steps are carried out one by one, and each record is written before the next one begins."""
