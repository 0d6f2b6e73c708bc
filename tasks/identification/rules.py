"""Decision rules of a verdict: thresholds and counts, kept apart from the solvers."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class JointRules:
    """Thresholds and counts of the joint fit of a car that its vehicle file hardly knows.

    Parameters
    ----------
    unknown_gain_tolerance : tolerance of the brake gain from which a vehicle file hardly knows its car [1]
    fewest_runs : training or held-out runs below which a joint fit judges [1]
    foreign_misfit : error of the held-out speed over its noise from which more is lacking than what is named [1]
    missed_share : share of some channel's held-out error that a name must leave at most, where stops are missed by more
        than `foreign_misfit` with it [1]
    noticed_share : the same where they are not [1]
    driven_acceleration : mean drive force before the brake, over the mass, from which a car is driven [m s-2]
    brake_onset_share : share of a run's largest pressure from which the driver brakes [1]
    braking_deceleration : deceleration above which a run brakes hard enough to show something of the brake [m s-2]
    fewest_curve_stops : braking runs from which the shape of the brake's curve can be read [1]
    saturation_ratio : peak deceleration over that of the model's tyres above which they grip better than it says [1]
    limited_time : time from which the file's wheels at their tyres' limit say that a run shows friction [s]
    least_pressure_range : brake pressure that a campaign is taken to reach at least, for its priors [MPa]
    least_disc_range : range of the discs' temperatures, as training runs begin, from which they show fade [K]
    delay_interval : interval between samples up to which a log tells a lag from a dead time [s]
    coasted_share : share of its speed that a run must lose for its resistances to be told apart [1]
    closed_throttle : share of the throttle up to which it is closed [1]
    false_name_chance : chance that a number which is 0 is named for one sign [1]
    fewest_scatter_runs : runs from which their scatter says how certain a number is [1]
    longest_memory : time over which misfit of a joint fit remembers at most [s]
    most_residual_correlation : correlation of residuals from sample to sample beyond which more is not told apart [1]
    better_prediction_share : share of the held-out speed error below which a fit without a number predicts better [1]
    equal_prediction_share : share of the held-out misfit of all channels up to which a fit without a number is as
        good [1]
    same_fit_errors : standard errors within which the numbers of two fits are the same [1]
    wrong_number_tolerances : tolerances from which a number of the vehicle file is wrong [1]
    rival_gain_share : share of the named number's gain from which another counts as a rival [1]
    worse_limit : ratio of held-out errors from which a channel is worse than under the frozen model [1]
    """

    unknown_gain_tolerance: float
    fewest_runs: int
    foreign_misfit: float
    missed_share: float
    noticed_share: float
    driven_acceleration: float
    brake_onset_share: float
    braking_deceleration: float
    fewest_curve_stops: int
    saturation_ratio: float
    limited_time: float
    least_pressure_range: float
    least_disc_range: float
    delay_interval: float
    coasted_share: float
    closed_throttle: float
    false_name_chance: float
    fewest_scatter_runs: int
    most_residual_correlation: float
    longest_memory: float
    better_prediction_share: float
    equal_prediction_share: float
    same_fit_errors: float
    wrong_number_tolerances: float
    rival_gain_share: float
    worse_limit: float


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
    joint : of the joint fit
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
    joint: JointRules
