"""Datasets of a UFF file as text."""


def dataset(kind: int, *lines: str) -> bytes:
    return "\n".join(["    -1", f"{kind:6d}", *lines, "    -1", ""]).encode()
