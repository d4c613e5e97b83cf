"""The gap between simulation and measurement: where it lies, which effect causes it, how far it shrinks.

Read in this order:

- What was measured: `measurement`. What is unknown: `parameter`.
- One simulation of both rigs: `bench` says what parameters make of the drawing, `baseline` is the paper's model of it,
  `bar` and `beam_rig` answer a hammer; `simulation` answers a sine too, and puts all together with derivatives.
- The catalogue: `effect` is what an effect is, `effects` holds one file for each, `catalogue` lists them.
- Which: `fit` finds the most likely parameters of one model, `linear_step` says which effects promise anything,
  `search` tries those, `evidence` weighs models, `verdict` says what follows.
- Where: `structure` counts misfit beyond noise, `location` maps it. How far: `held_out`.
- What cannot be told apart, and which check would tell: `twins`. What is wrong with the measurement itself: `faults`.
- All of it: `diagnosis`.
"""
