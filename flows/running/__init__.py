"""Where the work happens, and what is told meanwhile."""
