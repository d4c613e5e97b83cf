"""Sealed trials of the diagnosis: cases whose truth is committed to before it is asked for, and scored afterwards.

`plan` chooses the cases, `folder` keeps seals, answers and judgements, `worker` diagnoses in a process that knows the
measurement alone, `instruments` measures a case over the wires, `detectability` computes which effects could have been
found, `judge` and `marks` compare one answer with its truth, `summary` sums up, `run` does the whole.
`demonstration` is the one sealed bench of `jointlab demo`.
"""
