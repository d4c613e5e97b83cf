"""The gap between simulation and measurement: where it lies, which effect causes it, how far it shrinks.

Read in this order; each package imports those above it, and the list names the file to read first:

- The data: `measurement`. The unknowns: `parameter`. What they change: `bench`. The definition of an effect: `effect`.
- `outside_catalogue`: changes that no effect of the catalogue makes.
- `simulation`: one simulation of both rigs with its derivatives (`two_rigs`), from the paper's model (`baseline`) and
  effects on top of it.
- `effects`: one file for each family; `catalogue` lists them.
- `evidence`: how models of any structure compare (`model_evidence`), and the probability of each explanation
  (`verdict`).
- `fitting`: the most likely parameters of one model (`fit`), and what it predicts of data that were left out
  (`held_out`).
- `faults`: what is wrong with the measurement itself (`removal`).
- `search`: which effects (`single_effects`, then `forward_selection`).
- `findings`: where the gap lies (`location`), how far it shrinks (`gaps`), what no law explains (`shape_search`), and
  what the data cannot show (`missing_evidence`).
- `experiments`: which there are (`catalogue`), what to measure next (`next_experiment`), and the data that answer it.
- All of it: `diagnosis`. Other structures have a simulation, a fit and a search of their own: `structures`.
"""
