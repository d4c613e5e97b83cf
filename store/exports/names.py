"""Names of results in formats that do not take every name: no two become the same."""

from collections.abc import Callable, Collection, Iterable

ResultPath = tuple[str, ...]
"""Names from the kind of a result down to its part, as `content.RunPart.path`."""
LONGEST = 255
"""Characters of a name that has to be made another one, where a format sets no other limit."""


def distinct_paths(
    paths: Iterable[ResultPath], fit: Callable[[str], str], reserved: Collection[str] = (), longest: int = LONGEST
) -> dict[ResultPath, ResultPath]:
    """The paths, and what each of them begins with, with names that `fit` has made fit for a format.

    Where two names at one place become the same, or one is `reserved`, the later one ends in a number.
    """
    found: dict[ResultPath, ResultPath] = {(): ()}
    taken = set[ResultPath]()
    for path in paths:
        for own in (path[:depth] for depth in range(1, len(path) + 1)):
            if own in found:
                continue
            above, name = found[own[:-1]], fit(own[-1])
            made, number = name, 1
            while (*above, made) in taken or made in reserved:
                number += 1
                made = f"{name[: longest - len(f'_{number}')]}_{number}"
            found[own] = (*above, made)
            taken.add(found[own])
    return found
