"""The parts of the view of results: how each is read from the store, and shown."""
