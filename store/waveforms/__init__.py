"""Raw samples, and the append-only files that keep them."""
