"""What a diagnosis says beside its verdict: where the gap lies, how far it shrinks, what is left and not measured."""
