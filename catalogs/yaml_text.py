"""YAML text becomes plain values: every fault of keys and values with its line, nothing that grows without bound."""

import re
from math import isfinite
from typing import Any, ClassVar

import yaml

from catalogs.sentences import cap_problems, is_encodable, shorten, shorten_value
from tasks.errors import InputError

MOST_VALUES = 500_000
"""Keys and values of a YAML document with every alias written out [1]: 20,000 scenarios of ten fields have 420,000."""
DEEPEST = 64
"""Tables and lists inside each other [1]: no document of the project needs ten; each level is a call of a parser."""
LARGEST_INTEGER = 2**53
"""Beyond it a float does not hold every integer, and JSON readers differ (RFC 8785, RFC 7493)."""
LONGEST_NUMBER = 400
"""Characters of a number [1]: the largest float takes 309 digits."""
OTHER_BASES = re.compile(r"[-+]?(0_*[0-9][0-9_]*|[0-9][0-9_]*(:[0-5]?[0-9])+(\.[0-9_]*)?)")
"""Numbers that YAML 1.1 reads to the base of 8 or 60: 0420 is 272, and 7:00 is 420."""

_TAG = "tag:yaml.org,2002:"
_SCALAR_TAGS = tuple(_TAG + name for name in ("null", "bool", "int", "float", "str"))
_MERGE = _TAG + "merge"


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """PyYAML's safe loader; a date stays the text that it is."""

    yaml_implicit_resolvers: ClassVar[dict[str, Any]] = {
        first: [(tag, pattern) for tag, pattern in rules if tag in (*_SCALAR_TAGS, _MERGE)]
        for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }


def load_yaml(text: str, start: str, *, finite: bool) -> Any:
    """The value of a YAML text; None of an empty one.

    Parameters
    ----------
    text : the document
    start : of each sentence, up to "must"
    finite : refuse infinite numbers and NaN

    Raises
    ------
    InputError
        One sentence for each fault.
    """
    loader = None
    try:
        _check_shape(text, start)
        loader = _Loader(text)
        node = loader.get_single_node()
        if node is None:
            return None
        if problems := _find_node_problems(loader, node, finite):
            raise InputError(cap_problems([f"{start} {problem}" for problem in problems]))
        return loader.construct_document(node)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = f"line {mark.line + 1}: " if mark else ""
        rule = " ".join(filter(None, (error.context, error.problem)))
        raise InputError(f"{start} be valid YAML; {line}{shorten(rule or error)}") from None
    except yaml.YAMLError as error:
        raise InputError(f"{start} be valid YAML; {shorten(error)}") from None
    finally:
        if loader is not None:
            loader.dispose()


def _check_shape(text: str, start: str) -> None:
    """Refuse YAML that is too deep, too large once its aliases are written out, or that holds itself."""
    total = 0
    sizes: dict[str, int] = {}
    opened: list[tuple[str | None, int]] = []
    for event in yaml.parse(text, Loader=_Loader):
        line = event.start_mark.line + 1 if event.start_mark else 0
        if isinstance(event, yaml.CollectionEndEvent):
            anchor, before = opened.pop()
            if anchor:
                sizes[anchor] = total - before
            continue
        if isinstance(event, yaml.CollectionStartEvent):
            opened.append((event.anchor, total))
        elif isinstance(event, yaml.AliasEvent):
            if any(anchor == event.anchor for anchor, _ in opened):
                raise InputError(
                    f"{start} not hold itself; line {line}: *{shorten_value(event.anchor)} stands inside"
                    " what it names"
                )
            total += sizes.get(event.anchor or "", 1) - 1
        elif not isinstance(event, yaml.ScalarEvent):
            continue
        total += 1
        if len(opened) > DEEPEST:
            raise InputError(
                f"{start} have at most {DEEPEST} tables and lists inside each other; line {line} has more"
            )
        if total > MOST_VALUES:
            raise InputError(
                f"{start} have at most {MOST_VALUES} keys and values with its aliases written out; it has more"
            )


def _find_node_problems(loader: Any, root: yaml.Node, finite: bool) -> list[str]:
    """Faults of keys and values, in the order of the text."""
    found: list[tuple[int, str]] = []
    waiting, seen = [root], {id(root)}
    while waiting:
        node = waiting.pop()
        children: list[yaml.Node] = []
        if isinstance(node, yaml.MappingNode):
            found += _find_key_problems(node)
            children = [value for _, value in node.value]
        elif isinstance(node, yaml.SequenceNode):
            children = node.value
        problem = _find_value_problem(loader, node, finite)
        if problem:
            found.append((node.start_mark.line, problem))
        for child in children:
            if id(child) not in seen:
                seen.add(id(child))
                waiting.append(child)
    return [f"{problem} (line {line + 1})" for line, problem in sorted(found, key=lambda one: one[0])]


def _find_key_problems(node: yaml.MappingNode) -> list[tuple[int, str]]:
    found, keys = [], set()
    for key, _ in node.value:
        line = key.start_mark.line
        if not isinstance(key, yaml.ScalarNode) or key.tag not in (_TAG + "str", _MERGE):
            shown = shorten(key.value, 40) if isinstance(key, yaml.ScalarNode) else "a table or list"
            found.append((line, f"have text as keys; one is {shown}: put it in quotes"))
        elif key.value in keys:
            found.append(
                (line, f"have distinct keys in a table; {shorten_value(key.value)} stands there twice")
            )
        else:
            keys.add(key.value)
    return found


def _find_value_problem(loader: Any, node: yaml.Node, finite: bool) -> str | None:
    plain = _SCALAR_TAGS
    if isinstance(node, yaml.CollectionNode):
        plain = (_TAG + ("map" if isinstance(node, yaml.MappingNode) else "seq"),)
    if node.tag not in plain:
        return f"hold plain values; one has the tag {shorten(node.tag, 40)}: remove it"
    if not isinstance(node, yaml.ScalarNode):
        return None
    if node.tag == _TAG + "str":
        return None if is_encodable(node.value) else "have whole characters; one is half of a surrogate pair"
    if len(node.value) > LONGEST_NUMBER:
        return f"have numbers of at most {LONGEST_NUMBER} characters; one has {len(node.value)}"
    if OTHER_BASES.fullmatch(node.value):
        return (
            f"have plain decimal numbers; YAML takes {node.value} for one to the base of 8 or 60: write it without the"
            " zero in front or the colon, or put it in quotes"
        )
    try:
        value = loader.construct_object(node)
    except (ValueError, KeyError, IndexError, OverflowError, yaml.YAMLError):
        return f"have values that keep to their tag; {shorten_value(node.value)} is no {node.tag.removeprefix(_TAG)}"
    if finite and isinstance(value, float) and not isfinite(value):
        return f"have finite numbers; one is {shorten(node.value, 40)}"
    if isinstance(value, int) and not -LARGEST_INTEGER <= value <= LARGEST_INTEGER:
        return f"have integers of at most 2^53; one is {shorten(node.value, 40)}"
    return None
