"""The one error that analysis raises for numbers it cannot work with."""


class AnalysisError(ValueError):
    """The input is not what the method needs; the message says what is wrong and what to do."""
