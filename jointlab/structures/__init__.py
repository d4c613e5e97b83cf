"""The gap of structures that are not ours: their data, their simulators and effects, and what a diagnosis says.

`plug_ins` finds simulators and effects of others, `curve_file` reads what was measured, `document` is the result as
JSON, `picture` draws it. The engine is `analysis.gap.structures`.
"""
