"""Decision rules of a verdict: thresholds and counts, kept apart from the solvers."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class DecisionRules:
    """Numbers of a decision; values, units and reasons stand in catalogs/decision_rules.yaml.

    Parameters
    ----------
    named_odds : odds from which something is named, and from which it is larger than what matters [1]
    slab_width : standard deviation of what a car may lack, over the smallest size that matters [1]
    spike_width : the same of a number that is not named [1]
    signature_error : relative error of an effect's signature in a model of the car [1]
    foreign_disagreement : mean square score of the runs beside the best explanation from which nothing is named [1]
    form_width : standard deviation of a form's values, over the size that matters at its port [1]
    form_odds : odds against a form outside the library, before any run [1]
    most_effects : candidates that one explanation can hold [1]
    beam_width : explanations of each size that grow further [1]
    most_turns : linearisations of the search at most [1]
    most_compared : explanations that are compared with the best one [1]
    discrepancy_limit : mean square of a channel's whitened leftover in a run from which its noise is widened [1]
    relinearisation_pull : pull, in prior sigmas, from which the runs are linearised anew at the session [1]
    least_expected_d2 : expected squared distance below which a planned run is not worth driving [1]
    retune_widening : factor on the session's tolerances when a model is re-tuned without any new effect [1]
    error_resamples : bootstrap resamples of the held-out errors [1]
    longest_lag : longest lag at which residual and brake pressure are correlated [s]
    step_misfit : misfit by halving the step from which a run counts as sensitive to the step and is left out [1]
    fewest_runs : number of other runs below which runs that are sensitive to the step are used too [1]
    foreign_misfit : error of the held-out speed over its noise, or pull of a number of the file over its tolerance,
        from which more is lacking than what is named [1]
    hardly_known_tolerance : tolerance of the brake's gain from which a vehicle file hardly knows it [1]
    command_tolerance : tolerance of that gain where the brake signal is no pressure [1]
    hardly_known_grip : tolerance of the grip that all runs share, where a file hardly knows its car [1]
    driven_acceleration : drive force before the brake, over the mass, from which a car is driven [m s-2]
    brake_onset_share : share of a run's largest pressure from which the driver brakes [1]
    closed_throttle : share of the throttle up to which it is closed [1]
    saturation_ratio : peak deceleration over that of the model's tyres above which they grip better than it says [1]
    limited_time : time from which the file's wheels at their tyres' limit say that a run shows friction [s]
    """

    named_odds: float
    slab_width: float
    spike_width: float
    signature_error: float
    foreign_disagreement: float
    form_width: float
    form_odds: float
    most_effects: int
    beam_width: int
    most_turns: int
    most_compared: int
    discrepancy_limit: float
    relinearisation_pull: float
    least_expected_d2: float
    retune_widening: float
    error_resamples: int
    longest_lag: float
    step_misfit: float
    fewest_runs: int
    foreign_misfit: float
    hardly_known_tolerance: float
    command_tolerance: float
    hardly_known_grip: float
    driven_acceleration: float
    brake_onset_share: float
    closed_throttle: float
    saturation_ratio: float
    limited_time: float
