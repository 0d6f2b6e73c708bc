"""Mutated trees of JSON and YAML: the text is well formed, and what it holds is not what a reader expects."""

import json
import math
from collections.abc import Callable, Iterator
from random import Random
from typing import Any

from studies.fuzzing.rules import INF, NAN, Path, Rule


class Pairs(list[tuple[Any, Any]]):
    """A mapping as pairs, in which a key may stand twice."""


class Raw(str):
    """Text that stands in the document as it is."""


BOMB = "[" + ", ".join(
    [f"&l0 [{', '.join(['x'] * 9)}]", *(f"&l{k} [{', '.join([f'*l{k - 1}'] * 9)}]" for k in range(1, 9))]
) + "]"  # fmt: skip
"""Nine levels of nine aliases: 400 million entries in 400 bytes."""
ODD: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 2**31, 2**53 + 1, 2**70, -(2**63) - 1, 0.5, -0.0, 1e-320, 1e308, -1e308, NAN,
    INF, -INF,
    "", " ", "x", "0", "nan", "true", "[/red]", "[bold]x", "a[b]c", "\x1b[31mred", "a\x00b", "\u202eabc",
    "\ud800", "%s%n",
    "{x}", "<script>alert(1)</script>", "'; DROP TABLE clips; --", 'a" , 1) AS "a"', "*", "a\nb", "../../x",
    "/etc/passwd",
    "~", "C:\\x", "é" * 200, "x" * 300, "x" * 100_000, [], {}, [[]], [1, 2], [None], {"a": 1}, {"value": 1},
    [NAN] * 3,
    Raw("[" * 100_000), Raw("[" * 900 + "]" * 900), Raw('{"a":' * 5_000 + "1" + "}" * 5_000), Raw("1" * 5_000),
    Raw("1e999"), Raw("-"), Raw(""),
)  # fmt: skip
ODD_IN_YAML: tuple[Any, ...] = (
    *(Raw(text) for text in (
        BOMB, "&a [*a]", "&a {a: *a}", "*nowhere", "2026-01-01", "2026-01-01T00:00:00Z", "!!binary aGk=",
        "!!set {a, b}",
        "!!omap [a: 1]", "!!python/object/apply:os.getcwd []", "!!python/name:os.system", "!unknown x", "=",
        "<<", "0x1F",
        "12:30:45", "1_000", "0o17", "!!float x", "!!int 1.5", "!!timestamp x", "{<<: 7}", "{? [a, b] : c}", "{1: 2}",
        "{null: 1}", "{a: 1, a: 1}", "!!str", "9999-99-99",
    )),
)  # fmt: skip
ODD_KEYS: tuple[Any, ...] = (
    None,
    1,
    True,
    1.5,
    "",
    "x" * 2_000,
    "[/red]",
    "a|b",
    "a/b",
    "../x",
    "__class__",
    "\x00",
)


def format_tree(tree: Any, yaml: bool) -> str:
    """A tree as JSON, or as YAML in flow style."""
    if isinstance(tree, Raw):
        return tree
    if isinstance(tree, dict | Pairs):
        pairs = tree.items() if isinstance(tree, dict) else tree
        return (
            "{"
            + ", ".join(f"{_format_key(key, yaml)}: {format_tree(value, yaml)}" for key, value in pairs)
            + "}"
        )
    if isinstance(tree, list):
        return "[" + ", ".join(format_tree(value, yaml) for value in tree) + "]"
    if yaml and isinstance(tree, float):
        return _yaml_number(tree)
    return json.dumps(tree, default=str)


def _format_key(key: Any, yaml: bool) -> str:
    return format_tree(key, yaml) if yaml or isinstance(key, str) else json.dumps(str(key))


def _yaml_number(number: float) -> str:
    if not math.isfinite(number):
        return ".nan" if math.isnan(number) else ".inf" if number > 0 else "-.inf"
    text = repr(number)
    # YAML 1.1 takes a number without a point for a word
    return text if "." in text or "e" not in text else text.replace("e", ".0e")


def list_places(tree: Any, path: Path = ()) -> Iterator[tuple[Path, Any]]:
    """Every place of a tree, its root first."""
    yield path, tree
    children = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in children:
        yield from list_places(value, (*path, key))


def change_value(tree: Any, path: Path, change: Callable[[Any], Any]) -> Any:
    """The tree with another value at one place."""
    if not path:
        return change(tree)
    key, rest = path[0], path[1:]
    if isinstance(tree, dict):
        return {k: change_value(v, rest, change) if k == key else v for k, v in tree.items()}
    return [change_value(v, rest, change) if k == key else v for k, v in enumerate(tree)]


def break_rule(rng: Random, tree: Any, rule: Rule) -> Any | None:
    """The tree with the rule broken at one place; None where it holds at none."""
    under = [path for path, value in list_places(tree) if path and rule.holds_at(path, value)]
    if not under:
        return None
    path, value = rng.choice(under), rng.choice(rule.values)
    if not rule.of_keys:
        return change_value(tree, path, lambda _: value)
    return change_value(
        tree, path[:-1], lambda node: {value if key == path[-1] else key: held for key, held in node.items()}
    )


def with_key_twice(rng: Random, tree: Any) -> Any | None:
    """The tree with one key twice; None where there is no key."""
    path = _pick_mapping(rng, tree)
    if path is None:
        return None

    def double(node: dict[Any, Any]) -> Pairs:
        key = rng.choice(list(node))
        return Pairs([*node.items(), (key, rng.choice([node[key], 1]))])

    return change_value(tree, path, double)


def with_unknown_key(rng: Random, tree: Any, maps: Callable[[Path], bool]) -> Any | None:
    """The tree with a key that nobody knows, in a mapping whose place ``maps`` takes."""
    path = _pick_mapping(rng, tree, maps)
    return None if path is None else change_value(tree, path, lambda node: {**node, "no_such_key": 1})


def change_oddly(rng: Random, tree: Any, yaml: bool) -> Any:
    """The tree with something unexpected at one place."""
    path, value = rng.choice(list(list_places(tree)))
    match rng.randrange(8):
        case 0 if isinstance(value, dict) and value:
            gone = rng.choice(list(value))
            return change_value(tree, path, lambda node: {k: v for k, v in node.items() if k != gone})
        case 1 if isinstance(value, dict) and value:
            old, new = rng.choice(list(value)), rng.choice(ODD_KEYS)
            return change_value(tree, path, lambda node: {new if k == old else k: v for k, v in node.items()})
        case 2 if isinstance(value, list) and value:
            return change_value(tree, path, lambda node: node[: rng.randrange(len(node))])
        case 3 if isinstance(value, list) and value:
            return change_value(
                tree, path, lambda node: [*node, *[rng.choice(node)] * rng.choice([1, 3, 300])]
            )
        case 4 if isinstance(value, int | float):
            return change_value(
                tree, path, lambda node: rng.choice([-node, node * 1e6, node * 1e-6, str(node), [node]])
            )
        case 5:
            _, other = rng.choice(list(list_places(tree)))
            return change_value(tree, path, lambda _: other)
    choice = rng.choice(ODD_IN_YAML if yaml and rng.random() < 0.3 else ODD)
    return change_value(tree, path, lambda _: choice)


def _pick_mapping(rng: Random, tree: Any, maps: Callable[[Path], bool] = lambda _: True) -> Path | None:
    found = [path for path, value in list_places(tree) if isinstance(value, dict) and value and maps(path)]
    return rng.choice(found) if found else None
