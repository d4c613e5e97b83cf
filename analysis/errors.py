"""The error that analysis raises for numbers that it cannot use."""


class AnalysisError(ValueError):
    """The input is not what the method needs; the message says what is wrong and what to do."""


class NoModeError(AnalysisError):
    """Accelerances show no mode, so that nothing is identified from them."""
