"""The limits a generated clip must keep."""

from pathlib import Path

import yaml

GATES = Path(__file__).with_name("gates.yaml")


def load_gates(path: Path = GATES) -> dict[str, float]:
    """Limit by name, in the unit that the name ends with; see ``gates.yaml`` for the sources."""
    return {name: float(entry["value"]) for name, entry in yaml.safe_load(path.read_text()).items()}
