"""The gap between simulation and measurement: where it lies, which effect causes it, how far it shrinks.

Read in this order:

- The data: `measurement`. The unknowns: `parameter`.
- One simulation of both rigs: `bench` holds the quantities that parameters change, `baseline` is the paper's model,
  `free_beam_modes` and `beam_rig` give the response to a blow; `simulation` joins both rigs, with derivatives.
- The catalogue: `effect` defines what an effect can change, `effects` has a file for each family, `catalogue` lists
  them.
- Faults of the measurement come first: `faults` (of records), `row_faults` with `rough_fit`, `mains_detection`.
- Which effect: `fit` finds the most likely parameters of one model, `screening` predicts which effects are promising,
  `search` fits those, `forward_selection` adds any number of them; `evidence` compares models, `verdict` gives their
  probabilities, with what trials say in `calibration`; `findings` is what a diagnosis says beside its verdict.
- Where: `residual_structure` separates misfit from noise, `location` maps it. How far: `held_out`, and `gaps` with the
  floor.
- What to measure next: `next_experiment`, by `expected_data` and `information`. What these data cannot show:
  `missing_evidence`.
- All of it: `diagnosis`.
"""
