"""The gap between simulation and measurement: where it lies, which effect causes it, how far it shrinks.

Read in this order:

- What was measured: `measurement`. What is unknown: `parameter`.
- One simulation of both rigs: `bench` says what parameters make of the drawing, `baseline` is the paper's model of it,
  `bar` and `beam_rig` answer a hammer, `tester_rig` answers a sine; `simulation` puts them together with derivatives.
- The catalogue: `effect` is what an effect is, `effects` holds one file for each, `catalogue` lists them.
- Which: `fit` finds the most likely parameters of one model, `evidence` weighs models, `search` tries them,
  `verdict` says what follows. Where: `location`. How far: `held_out`. What cannot be told apart, and which measurement
  would tell: `twins`. All of it: `diagnosis`.
"""
