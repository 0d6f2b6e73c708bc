"""Works are read out of the sentences that sources are, with the DOI that belongs to each."""

import pytest

from studies.lineage.citations import find_works, first_clause, join_works


@pytest.mark.parametrize(
    ("source", "works"),
    [
        (
            "10:1 nominal, +-20 %; Judson & Doesken 2000, doi:10.1175/1520-0477(2000)081<1577:DOFFSI>2.3.CO;2",
            {"Judson & Doesken 2000": "10.1175/1520-0477(2000)081<1577:DOFFSI>2.3.CO;2"},
        ),
        (
            "Atlas, Srivastava & Sekhon 1973, doi:10.1029/RG011i001p00001, v = 9.65 - 10.3 exp(-0.6 D)",
            {"Atlas, Srivastava & Sekhon 1973": "10.1029/RG011i001p00001"},
        ),
        (
            "fresh snow 0.80 (Oke 1987, table 1.1), falling towards red (Warren 1982, doi:10.1029/RG020i001p00067)",
            {"Oke 1987": "", "Warren 1982": "10.1029/RG020i001p00067"},
        ),
        (
            "declared; as Kajikawa 1989 (doi:10.2151/jmsj1965.67.5_731) saw",
            {"declared": "", "Kajikawa 1989": "10.2151/jmsj1965.67.5_731"},
        ),
        (
            "Kasten & Czeplak 1980, doi:10.1016/0038-092X(80)90391-6: 1 - 0.75",
            {"Kasten & Czeplak 1980": "10.1016/0038-092X(80)90391-6"},
        ),
        ("data sheet, doi:10.5281/zenodo.12345.", {"doi:10.5281/zenodo.12345": "10.5281/zenodo.12345"}),
        ("the paper's snow at its lowest mu_c, 0.24; no reference run on ice", {"paper": ""}),
        ("frozen anchor, +-10 %; Ivan et al. 2010, JHR 10-324", {"Ivan et al. 2010": ""}),
        ("ROADVIEW bmw_m8.yaml: mass 2074.4 (measured) less unsprung_mass", {}),
    ],
)  # fmt: skip
def test_a_source_names_these_works(source, works):
    assert find_works(source) == works


def test_a_doi_that_one_line_gives_is_that_of_every_line_that_cites_the_work():
    found = [find_works("Oke 1987, doi:10.1000/x; street"), find_works("asphalt (Oke 1987)")]
    assert join_works(found) == join_works(found[::-1]) == {"Oke 1987": "10.1000/x"}


def test_a_source_in_words_is_called_by_its_first_clause():
    assert first_clause("ROADVIEW bmw_m8.yaml, lf (measured)") == "ROADVIEW bmw_m8.yaml"
    assert first_clause("daylight (CIE 15:2018), in sRGB") == "daylight (CIE 15:2018)"
