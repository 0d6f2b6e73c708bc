"""Studies of the paper: ``python -m studies sensitivity`` and ``ablation``."""
