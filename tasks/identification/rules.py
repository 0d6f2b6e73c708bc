"""Decision rules of a verdict: thresholds and counts, kept apart from the solvers."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class JointRules:
    """Thresholds and counts of the joint fit of a car that its vehicle file hardly knows.

    Parameters
    ----------
    unknown_gain_tolerance : tolerance of the brake gain from which a vehicle file hardly knows its car [1]
    fewest_runs : training or held-out runs below which effects cannot be screened one by one [1]
    foreign_misfit : misfit of a calibrated car over its sensors' noise from which its equations are not the model's [1]
    questioned_misfit : error of the held-out speed over its noise from which a name is held against a joint fit [1]
    missed_share : share of some channel's held-out error that a name must leave at most, where stops are missed by more
        than `foreign_misfit` with it [1]
    noticed_share : the same where they are not, and where the gain was not known [1]
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
    """

    unknown_gain_tolerance: float
    fewest_runs: int
    foreign_misfit: float
    questioned_misfit: float
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


@dataclass(frozen=True, kw_only=True)
class DecisionRules:
    """Thresholds and counts of a decision; values, units and reasons stand in catalogs/decision_rules.yaml.

    Parameters
    ----------
    accept_score : score from which an effect may be named: gain / inflation - parameters x log N [1]
    held_out_gain : fall of the held-out misfit from which an effect may be named [1]
    rival_span : difference of scores within which two explanations cannot be told apart [1]
    rival_gain_share : share of the named effect's gain from which another effect counts as a rival [1]
    discrepancy_limit : mean square of a channel's whitened leftover in a run from which its noise is widened [1]
    foreign_inflation : inflation beside the best effects, and form, from which the car's equations are not the model's
        [1]
    disputed_inflation : inflation of a name from which the runs disagree about it, which tells the same [1]
    win_share : share of bootstrap resamples that the named effect must win [1]
    bootstrap_resamples : bootstrap resamples of the runs [1]
    refined_candidates : candidates of a screening that are refined through the simulation [1]
    refined_look_alikes : nearly collinear effects of the best candidate that are refined too [1]
    look_alike_cosine : cosine between two library directions, nuisances projected out, from which they are nearly
        collinear [1]
    hopeful_share : share of what a name needs, or of the best, that a first and linear estimate must reach [1]
    trusted_screen_share : share of the best gain below which a linear gain counts without refinement [1]
    relinearisation_gain : gain from which derivatives taken without an effect no longer hold with it [1]
    reached_share : share of the linear gain that a first fit must reach to need no other start [1]
    most_effects : effects that one campaign can name [1]
    explored_candidates : candidates refined while only the disturbances are to be scaled [1]
    relinearised_candidates : candidates of a round that are linearised anew, if their gain is large [1]
    relinearisation_change : relative change of parameters below which a second relinearisation is not needed [1]
    retune_pull : pull of a session nuisance, in prior sigmas, from which it is a wrong number of the
        vehicle, and a name beside it is held against a joint fit [1]
    negligible_share : change of a number that no session re-tunes, below which it is not wrong [1]
    relinearisation_pull : pull, in prior sigmas, from which the runs are linearised anew at the session [1]
    disagreement : inflation of a named effect from which a single form is compared with it; of the runs without any
        name, from which speed and accelerometer are asked alone [1]
    lone_form_share : share of the named effects' gain from which a single form is compared with them [1]
    least_expected_d2 : expected squared distance below which a planned run is not worth driving [1]
    retune_widening : factor on the session's tolerances when a model is re-tuned without any new effect [1]
    error_resamples : bootstrap resamples of the held-out errors [1]
    worse_limit : ratio of held-out errors from which a channel is worse than under the frozen model [1]
    retuned_limit : error of the held-out runs, of a channel along the road or of all, over that of the re-tuned model,
        beyond which nothing is named [1]
    noticed_share : share of a held-out error below which an effect makes a noticeable difference to it [1]
    longest_lag : longest lag at which residual and brake pressure are correlated [s]
    interval_widening : factor on the length of intervals for what the likelihood does not hold, such as the noise of
        the pressure gauge [1]
    profile_points : points of the profile likelihood tried on each side of an estimate [1]
    profile_tolerance : relative error of the root deviance at which the profile is followed no further [1]
    step_misfit : misfit by halving the step from which a run counts as sensitive to the step and is left out [1]
    fewest_runs : number of other runs below which runs that are sensitive to the step are used too [1]
    joint : of the joint fit
    """

    accept_score: float
    held_out_gain: float
    rival_span: float
    rival_gain_share: float
    discrepancy_limit: float
    foreign_inflation: float
    disputed_inflation: float
    win_share: float
    bootstrap_resamples: int
    refined_candidates: int
    refined_look_alikes: int
    look_alike_cosine: float
    hopeful_share: float
    trusted_screen_share: float
    relinearisation_gain: float
    reached_share: float
    most_effects: int
    explored_candidates: int
    relinearised_candidates: int
    relinearisation_change: float
    retune_pull: float
    negligible_share: float
    relinearisation_pull: float
    disagreement: float
    lone_form_share: float
    least_expected_d2: float
    retune_widening: float
    error_resamples: int
    worse_limit: float
    retuned_limit: float
    noticed_share: float
    longest_lag: float
    interval_widening: float
    profile_points: int
    profile_tolerance: float
    step_misfit: float
    fewest_runs: int
    joint: JointRules

    @property
    def cross_validated_gain(self) -> float:
        """Return the fall of the misfit by which training runs, each left out in turn, must confirm a name [1].

        They chose the candidate, so they must confirm it by as much as a score asks, which is twice that in misfit.
        """
        return 2.0 * self.accept_score
