"""The search for the effects that explain a gap: one after the other, and any number of them."""
