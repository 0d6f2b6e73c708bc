"""Studies of the paper: ``musync lab sensitivity`` and ``ablation``."""
