"""Rows of what was measured: runs, blows, sine records, instruments and specimens."""
