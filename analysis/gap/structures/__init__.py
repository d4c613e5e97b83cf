"""The gap of any structure: the data are curves, and users may write simulators and effects of their own.

Read in this order:

- `curve`: what was measured, in parts that can be left out.
- `simulator` and `effect`: the two protocols; another structure or another effect is one of these.
- `likelihood`: the most likely parameters of one model. `search`: which effects. `diagnosis`: the whole.
- Simulators: `single_degree` (with `steady_response` and `record_response`), `modal_structure`, `callable_simulator`.
- Effects for them: `material_effects` and `attached_effects` (with `measured_amplitude`), `chain_effects`.

Evidence, verdict and probabilities are those of the beam rig (`analysis.gap.evidence`).
"""
