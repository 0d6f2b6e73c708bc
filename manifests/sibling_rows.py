"""The pairs of `manifests.siblings.sibling_pairs`, one after the other and not in a list."""

from array import array
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from manifests.siblings import CONTROLS, _choose_pairs, _group_clips, _list_differing, _make_pair


def iterate_pairs(clips: Sequence[Mapping[str, Any]]) -> Iterator[dict[str, Any]]:
    """Yield every pair that differs in exactly one control, in the order of `manifests.siblings.sibling_pairs`.

    Parameters
    ----------
    clips : records with ``clip_id``, ``label``, ``scenario`` and ``figures``
    """
    first, second, turned = array("i"), array("i"), array("b")
    names = sorted(CONTROLS)
    for code, control in enumerate(names):
        for group in _group_clips(clips, control):
            for i, j in _choose_pairs(group):
                first.append(i)
                second.append(j)
                turned.append(code)
    for place in np.lexsort((np.asarray(turned), np.asarray(second), np.asarray(first))):
        a, b, control = clips[first[place]], clips[second[place]], names[turned[place]]
        if _list_differing(a, b, control):
            yield _make_pair(a, b, control)
