"""The page of a verdict by a joint fit: one HTML file that needs no other."""

from collections.abc import Mapping
from html import escape
from typing import Any

from tasks.campaign.campaign import Campaign
from tasks.identification.joint.verdict import JointTrace


def joint_report_html(trace: JointTrace, result: Mapping[str, Any], campaign: Campaign) -> str:
    """Return the page.

    Parameters
    ----------
    trace : the verdict and what it stands on
    result : the verdict as plain values
    campaign : measured runs
    """
    return f"<h1>{escape(campaign.name)}</h1><p>{escape(trace.sentence)}</p><p>{escape(str(result['verdict']))}</p>"
