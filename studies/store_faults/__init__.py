"""The dataset store under faults: random sequences of commands on a disk or an object store that fails at any step."""
