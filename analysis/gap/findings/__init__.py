"""What a diagnosis says beside its verdict: where the gap lies, how far it shrinks, what is left and not measured.

Also the model that is handed on: its values, and whether an effect of it helps on another article.
"""
