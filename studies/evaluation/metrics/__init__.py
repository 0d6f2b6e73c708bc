"""Metrics of finished frames that serve the evaluation and foreign videos; they share no code with what they judge."""
