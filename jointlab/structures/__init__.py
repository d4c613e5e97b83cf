"""The gap of other structures than the beam: their data, simulators, effects and diagnoses.

`plug_ins` finds simulators and effects of others, `curve_file` reads what was measured, `document` is the result as
JSON, `picture` draws it. The engine is `analysis.gap.structures`.
"""
