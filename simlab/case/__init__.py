"""Cases: a test article, the effects that the paper's model leaves out of it, and the bundle that a laboratory makes.

- `draw.py` draws a case from a seed; `campaign.py` holds how it is measured.
- `effects/` holds the effects that a real bench can show beyond the paper's model, one small class each.
- `simulate.py` gives the readings of both rigs without noise.
- `blows.py` adds noise and scatter, and averages as a laboratory does.
- `bundle.py` writes the folder that a laboratory would deliver, and the truth about it.
"""
