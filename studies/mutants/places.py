"""Places of a Python source where one operator, comparison or number can be changed."""

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

OTHER = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
    ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="), ast.And: ("and", "or"), ast.Or: ("or", "and"),
}  # fmt: skip
"""Symbol of each operator, and what takes its place."""
SAYS = (ast.Raise, ast.JoinedStr, ast.Import, ast.ImportFrom)
"""Statements and texts in which a number is no behaviour."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """One change of a file.

    Parameters
    ----------
    file : path in the tree
    line : number of the line [1]
    begin, end : the characters of the file that are replaced
    before, after : what stands there and what takes its place
    """

    file: Path
    line: int
    begin: int
    end: int
    before: str
    after: str

    def applied(self, text: str) -> str:
        """The file's text with the change."""
        return text[: self.begin] + self.after + text[self.end :]


def places_of(file: Path, text: str) -> list[Place]:
    """Return every place of a source where a change can be made.

    Parameters
    ----------
    file : path in the tree
    text : the source
    """
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    lines = text.splitlines()

    def offset(line: int, column: int) -> int:
        return starts[line - 1] + len(lines[line - 1].encode()[:column].decode())

    found = []
    for node in _behaviour(ast.parse(text)):
        for left, operator, right in _operations(node):
            begin = offset(left.end_lineno or 0, left.end_col_offset or 0)
            end = offset(right.lineno, right.col_offset)
            symbol, other = OTHER[type(operator)]
            place = text.find(symbol, begin, end)
            if place >= 0:
                found.append((place, symbol, other))
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            begin = offset(node.lineno, node.col_offset)
            end = offset(node.end_lineno or 0, node.end_col_offset or 0)
            found.append((begin, text[begin:end], repr(_other_number(node.value))))
    return [
        Place(
            file=file, line=text.count("\n", 0, begin) + 1, begin=begin, end=begin + len(before), before=before,
            after=after,
        )
        for begin, before, after in found
    ]  # fmt: skip


def _behaviour(node: ast.AST) -> Iterator[ast.AST]:
    """Every node below one, without annotations, decorators, texts and what is raised."""
    yield node
    for name, value in ast.iter_fields(node):
        if name in {"annotation", "returns", "decorator_list"}:
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not isinstance(child, SAYS):
                yield from _behaviour(child)


def _operations(node: ast.AST) -> Iterator[tuple[ast.expr, ast.AST, ast.expr]]:
    """Left side, operator and right side of what `OTHER` can change."""
    if isinstance(node, ast.BinOp):
        sides = [(node.left, node.op, node.right)]
    elif isinstance(node, ast.Compare):
        sides = list(zip([node.left, *node.comparators], node.ops, node.comparators, strict=False))
    elif isinstance(node, ast.BoolOp):
        sides = [(left, node.op, right) for left, right in zip(node.values, node.values[1:], strict=False)]
    else:
        return
    yield from (side for side in sides if type(side[1]) in OTHER)


def _other_number(value: float) -> float:
    return value + 1 if isinstance(value, int) or value == 0.0 else 2 * value
