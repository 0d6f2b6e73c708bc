"""False claims and motions of a dataset, and which metric sees which: ``musync lab controls``."""
