"""The parts of the view of results: what each reads from the store, and how it shows that."""
