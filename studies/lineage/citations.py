"""Works that the sources of catalogue values cite: who and when, and the DOI where one stands there."""

import re
from collections.abc import Iterable, Mapping

HEADS = ("paper", "declared")
"""First words of a source that say what a number is, whatever it cites: the publication's, or this project's choice."""
_CITED = re.compile(
    r"(?:[A-Z][\w.'-]*\s)*[A-Z][\w.'-]+(?:(?:, [A-Z][\w.'-]+)*,? (?:&|and) [A-Z][\w.'-]+| et al\.)?"
    r" (?:1[89]|20)\d\d(?!\d)"
)
LONGEST = 1000
"""Characters of a source that are searched [1]: three times the longest that ships."""
_DOI = re.compile(r"doi:(10\.\d{4,9}/\S+)")


def find_works(source: str) -> dict[str, str]:
    """Works that a source names, and the DOI of each that has one there.

    Parameters
    ----------
    source : of a catalogue value

    Returns
    -------
    Name of a work to its DOI or an empty text: works cited by author and year, a DOI that stands alone, and the heads
    of `HEADS`. Empty where a source is given in words alone.
    """
    source = source[:LONGEST]
    cited = list(_CITED.finditer(source))
    works = {head: "" for head in HEADS if re.match(rf"(?:the )?{head}\b", source)}
    for place, match in enumerate(cited):
        end = cited[place + 1].start() if place + 1 < len(cited) else len(source)
        doi = _DOI.search(source, match.end(), end)
        works[match.group()] = _trim_doi(doi.group(1)) if doi else ""
    if not cited and (doi := _DOI.search(source)):
        works[f"doi:{_trim_doi(doi.group(1))}"] = _trim_doi(doi.group(1))
    return works


def first_clause(source: str) -> str:
    """Return the words of a source before its first comma, semicolon or colon.

    Parameters
    ----------
    source : of a catalogue value
    """
    return re.split(r"[,;]|:\s", source.strip(), maxsplit=1)[0].strip() or source


def join_works(found: Iterable[Mapping[str, str]]) -> dict[str, str]:
    """Return every work once, by name, with the DOI that any of its mentions has.

    Parameters
    ----------
    found : results of `find_works`
    """
    works: dict[str, str] = {}
    for one in found:
        for name, doi in one.items():
            works[name] = works.get(name) or doi
    return dict(sorted(works.items()))


def _trim_doi(text: str) -> str:
    """A DOI without the punctuation of the sentence that it stands in."""
    trimmed = text.rstrip(",;:.")
    while trimmed.endswith(")") and trimmed.count(")") > trimmed.count("("):
        trimmed = trimmed[:-1].rstrip(",;:.")
    return trimmed
