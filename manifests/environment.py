"""The installed distributions as a CycloneDX list, from which the environment can be installed again."""

import importlib.metadata
import json
import re
from functools import lru_cache
from typing import Any

from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.model.license import LicenseExpression
from cyclonedx.output.json import JsonV1Dot6
from packageurl import PackageURL

LEFT_OUT = ("serialNumber", "metadata", "dependencies")
"""When and by what the list was written, because equal environments have equal lists; and who needs whom."""


@lru_cache
def environment_bom() -> dict[str, Any]:
    """Name, version, package URL and, where stated in SPDX, licence of every installed distribution, as CycloneDX 1.6.

    No path, no time and no random number gets into it.
    """
    components: dict[str, Component] = {}
    for distribution in importlib.metadata.distributions():
        component = _describe_component(distribution)
        if component is not None:
            components.setdefault(component.name, component)  # of two, the first is imported
    document: dict[str, Any] = json.loads(JsonV1Dot6(Bom(components=components.values())).output_as_string())
    return {key: value for key, value in document.items() if key not in LEFT_OUT}


def _describe_component(distribution: importlib.metadata.Distribution) -> Component | None:
    try:
        facts = distribution.metadata
    except (TypeError, FileNotFoundError):  # a folder without METADATA, which a broken installation leaves
        return None
    if "Name" not in facts or "Version" not in facts:
        return None
    name = re.sub(r"[-_.]+", "-", facts["Name"]).lower()
    address = PackageURL("pypi", name=name, version=facts["Version"])
    licences = [LicenseExpression(facts["License-Expression"])] if "License-Expression" in facts else []
    return Component(
        type=ComponentType.LIBRARY,
        name=name,
        version=facts["Version"],
        bom_ref=str(address),
        purl=address,
        licenses=licences,
    )
