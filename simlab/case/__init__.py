"""Sealed cases: a test article, what the paper's model leaves out of it, and the bundle of what a lab would measure.

- `draw.py` draws a case from a seed; `article.py` and `campaign.py` hold what is built and how it is measured.
- `effects/` holds what a real bench can show beyond the paper's model, one small class each, a file a family.
- `simulate.py` computes what both rigs would read without noise, by `coupling.py` on the free bar's modes.
- `estimate.py` adds the noise of hammer, accelerometer and hand, and averages as a lab does.
- `bundle.py` writes the folder that a lab would hand over, and the truth about it.
"""
