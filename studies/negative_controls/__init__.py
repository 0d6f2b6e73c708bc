"""False claims and motions of a dataset, and which metric sees which: ``python -m studies controls``."""
