"""The gap between simulation and measurement: where it lies, which effect causes it, how far it shrinks.

Read in this order:

- What was measured: `measurement`. What is unknown: `parameter`.
- One simulation of both rigs: `bench` says what parameters make of the drawing, `baseline` is the paper's model of it,
  `beam` and `beam_rig` answer a hammer; `simulation` answers a sine too, and puts all together with derivatives.
- The catalogue: `effect` is what an effect is, `effects` holds one file for each, `catalogue` lists them.
- What is wrong with the measurement itself comes first: `faults`, by rows (`row_faults`, `rough_fit`, `row_faults`)
  and in records of blows (`faults`, `mains`, `mains_detection`; a `record_effect` with its `parameter`).
- Which: `fit` finds the most likely parameters of one model, `screening` and `screening` say which effects promise
  anything, `search` tries those, `evidence` weighs models, `verdict` says what follows; `parallel_map` shares the work.
- Where: `structure` counts misfit beyond noise, `location` maps it. How far: `held_out`, and the `floor` below it.
- What cannot be told apart: `twins`; what would tell: `next_experiment`; for want of which measurement: `lost`.
- All of it: `diagnosis`.
"""
