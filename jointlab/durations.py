"""Lengths of time in words; terminal and page say the same."""


def duration(seconds: float, space: str = " ") -> str:
    """A length of time as people say it, with `space` between a number and its unit."""
    if seconds < 90:
        return f"{max(seconds, 0):.0f}{space}s"
    if seconds < 90 * 60:
        return f"{seconds / 60:.0f}{space}min"
    minutes = round(seconds / 60)
    return f"{minutes // 60}{space}h {minutes % 60:02d}{space}min"
