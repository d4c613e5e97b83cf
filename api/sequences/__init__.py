"""Sequence documents that come with Jointlab."""
