"""The sections of the view of results, one a file: what each reads from the store, and how it shows that."""
