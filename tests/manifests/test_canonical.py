import math

import pytest
import rfc8785

from manifests.canonical import canonical_bytes, content_id, sha256_of


def test_canonical_form_is_that_of_rfc_8785_section_3_2_2():
    # the sample of RFC 8785, section 3.2.2, in its canonical form of section 3.2.3
    sample = {
        "numbers": [333333333.33333329, 1e30, 4.50, 2e-3, 0.000000000000000000000000001],
        "string": "\u20ac$\u000f\u000aA'\u0042\u0022\u005c\\\"/",
        "literals": [None, True, False],
    }
    expected = (
        '{"literals":[null,true,false],"numbers":[333333333.3333333,1e+30,4.5,0.002,1e-27],'
        '"string":"€$\\u000f\\nA\'B\\"\\\\\\\\\\"/"}'
    )
    assert canonical_bytes(sample) == expected.encode()


def test_key_order_does_not_change_an_id():
    assert content_id({"a": 1, "b": [1.5, None]}) == content_id({"b": [1.5, None], "a": 1})


def test_nan_has_no_canonical_form():
    with pytest.raises(rfc8785.CanonicalizationError):
        canonical_bytes({"a": math.nan})


def test_hash_depends_on_the_bytes_and_not_on_how_they_are_cut():
    assert sha256_of([b"ab", b"c"]) == sha256_of([b"abc"])
    assert (
        sha256_of([b"abc"]) == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    )  # FIPS 180-2, B.1
