"""Sealed trials of the diagnosis: cases whose truth is committed to before it is asked for, and scored afterwards.

`plan` says which cases, `folder` keeps seals, answers and judgements, `worker` diagnoses in a process that knows a path
and nothing else, `instruments` measures a case over the wires, `detectability` says what could have been found,
`judgement` sets one answer beside its truth, `scores` and `tables` sum up, `run` does it all.
"""
