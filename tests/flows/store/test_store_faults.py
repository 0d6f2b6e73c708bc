"""A dozen of the sequences of ``make study-faults``: what holds while disk or requests fail at any step."""

import pytest

from studies.store_faults.study import study_faults


@pytest.mark.minutes
def test_under_any_sequence_of_faults_nothing_is_lost_nothing_is_half_and_the_bytes_come_out_equal():
    counts, broken = study_faults(sequences=12, first_seed=7)
    assert not broken, broken[0]
    assert counts["finished with equal bytes"] == counts["sequences"] >= 12
    assert sum(count for name, count in counts.items() if name.startswith("fault: ")) >= 5
