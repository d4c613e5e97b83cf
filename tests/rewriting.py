"""Bundles with less in them: few lines and points are quick to diagnose, and enough for most tests."""

from pathlib import Path

from store.exchange.accelerance_file import accelerance_functions, read_accelerances
from store.exchange.uff import write_uff


def rewrite(file: Path, lines: slice = slice(None), rows: int | None = None, coherence: bool = True) -> None:
    """Keep some lines, some rows, and coherence or not."""
    read = read_accelerances(file)
    kept = read.coherence if coherence else None
    functions = accelerance_functions(
        read.response,
        read.inputs[:rows],
        read.frequency[lines],
        read.accelerance[:rows, lines],
        None if kept is None else kept[:rows, lines],
    )
    write_uff(file, functions)


def with_fewer_lines(bundle: Path, every: int) -> Path:
    """The bundle with one line in so many."""
    for file in bundle.glob("inverse_*.unv"):
        rewrite(file, lines=slice(every - 1, None, every))
    return bundle


def with_fewer_points(bundle: Path, multiples_of: int) -> Path:
    """The bundle with those points of the tester whose frequency in Hz is a multiple: each mounting and amplitude."""
    file = bundle / "direct.csv"
    header, *lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    place = header.strip().split(",").index("frequency_hz")
    kept = [line for line in lines if float(line.split(",")[place]) % multiples_of == 0]
    assert len(kept) > 1
    file.write_text("".join((header, *kept)), encoding="utf-8")
    return bundle
