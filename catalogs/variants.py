"""Variants of the motion: which coupling of the paper's ablation (Section 4.4) is cut."""

from typing import Literal

Variant = Literal["appearance-only", "vertical-only", "fixed-mu", "no-low-speed-rule", "full"]
VARIANTS: dict[Variant, str] = {
    "appearance-only": "the weather is seen and not felt: dry friction",
    "vertical-only": "the road moves the body, nobody brakes",
    "fixed-mu": "one friction for all rain, one for all snow",
    "no-low-speed-rule": "the pitch follows the deceleration to the stop, without the rule of Appendix B",
    "full": "nothing is cut",
}
"""Effect of each variant (paper, Section 4.4; the low-speed rule is this project's own)."""


def warn_of_variant(variant: Variant) -> str:
    """Return the sentence that marks a dataset with a cut coupling; empty where nothing is cut.

    Parameters
    ----------
    variant : that the dataset was made in
    """
    if variant == "full":
        return ""
    return (
        f"Something is cut on purpose: variant {variant}, {VARIANTS[variant]}."
        " The picture is that of the scenario, the motion is not."
    )
