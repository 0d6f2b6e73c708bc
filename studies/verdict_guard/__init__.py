"""The guard of `close-loop`: labelled campaigns that a change of its rules must not judge worse."""
