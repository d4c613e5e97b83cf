"""Sealed trials of the diagnosis: cases whose truth is committed to before it is asked for, and scored afterwards.

`plan` says which cases, `folder` keeps seals, answers and judgements, `worker` diagnoses in a process that knows what
was measured and nothing else, `instruments` measures a case over the wires, `detectability` says what could have been
found, `judge` and `marks` set one answer beside its truth, `summary` sums up, `run` does it all. `fit_calibration`
learns from marks what theory cannot say; `demonstration` is the one sealed bench of `jointlab demo`.
"""
