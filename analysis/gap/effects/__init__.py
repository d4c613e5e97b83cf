"""The catalogue of effects, a file each; `analysis.gap.catalogue` finds them."""
