"""Names of results in formats that do not take every name: no two become the same."""

from collections.abc import Callable, Collection, Iterable

ResultPath = tuple[str, ...]
"""Names from the kind of a result down to its part, as `content.RunPart.path`."""
LONGEST = 255
"""Maximum length, in characters, of a name that gets a number to be unique, unless the format sets another limit."""


def distinct_paths(
    paths: Iterable[ResultPath], fit: Callable[[str], str], reserved: Collection[str] = (), longest: int = LONGEST
) -> dict[ResultPath, ResultPath]:
    """Map each path, and each beginning of a path, to a path of names that `fit` has made valid for a format.

    If two names under one parent become equal, or one is `reserved`, the later one gets a number at its end.
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
