"""Store, loading, questions and a braking run beside other tools, in one run."""
