"""Numbers in, numbers out: spectra, modes, joints, direct method, forward prediction, comparison.

Nothing here reads a file, opens a connection or knows where a number came from.
"""
