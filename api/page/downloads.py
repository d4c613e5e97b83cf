"""Files that a click fetches: tables as CSV, and what an export made."""

from __future__ import annotations

from fastapi import FastAPI

from api.service.context import Services


def add_downloads(app: FastAPI, services: Services) -> None:
    """Routes of files."""
