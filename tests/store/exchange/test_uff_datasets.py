"""A file is split into its datasets as whole as it says."""

from pathlib import Path

import pytest

from store.exchange.uff import read_uff, write_uff
from tests.store.exchange.test_uff import accelerance, units
from tests.store.exchange.uff_text import dataset


def test_no_dataset_is_lost_beside_lines_that_end_in_minus_one(tmp_path: Path) -> None:
    """Blanks after a delimiter, binary data in the same file, and a color of -1 hid what stood between two of them."""
    written = accelerance(unit="", denominator_unit="")
    write_uff(tmp_path / "a.unv", [written])
    write_uff(tmp_path / "t.unv", [written], binary=False)
    binary, text = (tmp_path / "a.unv").read_bytes(), (tmp_path / "t.unv").read_bytes()
    blanks = units(10, "1.00000000000000000D+03").replace(b"\n", b"  \r\n")
    strange = dataset(2435, f"{1:10d}{-1:10d}", f"{-1:10d}")
    node = dataset(2411, f"{3:10d}{1:10d}{1:10d}{-1:10d}", f"{0.5:25.16e}{0.0:25.16e}{0.0:25.16e}")
    (tmp_path / "b.unv").write_bytes(strange + blanks + node + strange + binary + text + binary)
    read = read_uff(tmp_path / "b.unv")
    assert [each.values[0] / written.values[0] for each in read.functions] == pytest.approx(3 * [1e-3])
    assert read.notes == ("b.unv: dataset 2435 is passed over",)
    assert read.nodes == {3: pytest.approx((0.0005, 0, 0))}
