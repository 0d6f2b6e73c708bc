"""Confusion of the attribution: python benchmarks/closure.py [seeds] [nulls] [effect ...]."""

import sys
import time
from collections import Counter

from catalogs.effects import load_effects
from catalogs.surfaces import load_surface
from catalogs.vehicles import load_vehicle
from tasks.closure.benchmark import exact_interval, outcome, synthetic_campaign
from tasks.closure.verdict import attribute

TRUTHS = {
    "aerodynamic_drag": {"drag_area": 0.7}, "rolling_resistance": {"rolling_coefficient": 0.012},
    "rolling_resistance_speed": {"rolling_speed": 0.0006}, "snow_ploughing": {"ploughing": 15.0},
    "idle_creep": {"creep_force": 600.0, "creep_speed": 5.0}, "engine_braking": {"engine_torque": 60.0},
    "rotating_inertia": {"wheel_inertia": 3.0}, "pad_drag": {"pad_drag": 40.0}, "brake_lag": {"lag": 0.08},
    "brake_dead_time": {"dead_time": 0.06}, "push_out_pressure": {"push_out": 0.1},
    "pressure_nonlinearity": {"pressure_curve": 0.04}, "brake_fade": {"fade": 0.05},
    "pad_friction_speed": {"pad_speed": 0.006, "pad_speed_reference": 15.0}, "bias_pressure": {"bias_pressure": 0.03},
    "relaxation_length": {"relaxation_length": 0.5}, "load_sensitivity": {"load_sensitivity": 0.15},
    "tyre_heating": {"tyre_heating": 0.4}, "wet_friction_speed": {"wet_speed": 0.01},
    "damper_asymmetry": {"damper_asymmetry": 0.3}, "suspension_friction": {"coulomb_friction": 80.0},
    "progressive_spring": {"progressive_rate": 4e6}, "anti_dive": {"anti_dive": 0.2}, "anti_lift": {"anti_lift": 0.2},
    "sensor_pitch_delay": {"pitch_delay": 0.05}, "sensor_speed_scale": {"speed_scale": 0.015},
    "retuned_pressure_gain": {"pressure_gain": 0.1},
    "sensor_gravity_leak": {"gravity_leak": 1.0},
}  # fmt: skip


def main() -> None:
    seeds, nulls = (int(a) for a in (*sys.argv[1:3], "1", "5")[:2]) if len(sys.argv) > 2 else (1, 5)
    chosen = sys.argv[3:] or list(TRUTHS)
    vehicle, surface, effects = load_vehicle("paper-reference"), load_surface("dense-asphalt"), load_effects()
    counts: Counter[str] = Counter()
    for truth in [None] * nulls + [name for name in chosen for _ in range(seeds)]:
        seed = 1000 + sum(counts.values())
        began = time.process_time()
        verdict = attribute(
            synthetic_campaign(vehicle, surface, TRUTHS[truth] if truth else {}, seed),
            vehicle,
            surface,
            effects,
        )
        kind = outcome(verdict, truth)
        counts[f"{'effect' if truth else 'null'}: {kind}"] += 1
        named = [(e.name, *(f"{p.value:.4g}" for p in e.parameters)) for e in verdict.effects]
        rivals = [rival.name for _, rival in verdict.rivals]
        print(truth, kind, verdict.verdict, named, rivals, f"{time.process_time() - began:.1f} s", flush=True)
    false = counts["null: false discovery"]
    if nulls:
        low, high = exact_interval(false, nulls)
        print(f"false discoveries on nulls: {false} of {nulls}, exact 95 % interval {low:.3f} to {high:.3f}")
    print(dict(counts))


if __name__ == "__main__":
    main()
