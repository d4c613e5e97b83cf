"""Sequences: the documents that say what is measured, and the plans that follow from them."""
