"""How large the project is: ``make size`` prints lines of code, words of documents and numeric constants.

A word has a letter or a digit; counted are the Markdown files of the root and of ``docs/``, code and tables included,
generated pages not. A sentence is four words or more of a paragraph, a list item or a cell of a table; a span of code
is one word, a link is its text, and a block of code is none. A constant is a module's name that is set to a number
other than -2, -1, 0, 1 and 2, a tuple of numbers or arithmetic of them.
"""

import ast
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PRODUCT = ("musync", "flows", "manifests", "catalogs", "tasks", "reference_pages", "benchmarks")
FOLDERS = (*PRODUCT, "studies", "tests")
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
LONG, PLAIN = 30, {0, 1, 2}  # words of a sentence that is not long; numbers that are no constants
NUMERIC = (ast.Constant, ast.Tuple, ast.UnaryOp, ast.BinOp, ast.unaryop, ast.operator, ast.Load)
NOT_PROSE = re.compile(r"\A---\n.*?^---$|^ *```.*?^ *```$|^#.*?$|<[^<>]+>|!\[[^\]]*\]\([^)]*\)", re.M | re.S)
NEW_TEXT = re.compile(r"\n\s*\n|^\s*(?:[-*]|\d+\.)\s|(?<!\\)\|", re.M)
SENTENCE_END = re.compile(r"[.!?][\"')*]*\s+(?=[A-Z\d*\"'(`])")


def list_sentences(text: str) -> Iterator[str]:
    """Yield the sentences of a Markdown document, without markup."""
    prose = re.sub(r"`[^`\n]+(?:\n[^`\n]+)?`", "CODE", NOT_PROSE.sub("\n\n", text))
    prose = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", prose)
    for part in NEW_TEXT.split(prose):
        yield from (line for line in SENTENCE_END.split(part) if len(line.split()) >= 4)


def measure_documents(documents: Iterable[Path] = DOCUMENTS) -> tuple[int, float]:
    """Return the words of Markdown files and the share of their sentences that are long [1]."""
    texts = [path.read_text(encoding="utf-8") for path in documents]
    lengths = [len(sentence.split()) for text in texts for sentence in list_sentences(text)]
    words = sum(any(map(str.isalnum, word)) for text in texts for word in text.split())
    return words, sum(n > LONG for n in lengths) / len(lengths)


def list_imports(tree: ast.Module, modules: set[str]) -> set[str]:
    """Return the modules of the project that a module imports, at its top or within a function."""
    named = {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            parts = (f"{node.module}.{name.name}" for name in node.names)
            named |= {part if part in modules else node.module for part in parts}
    return named & modules


def count_constants(tree: ast.Module) -> int:
    """Return how many names of a module are set to a number of its own."""
    nodes = [node for node in tree.body if isinstance(node, ast.Assign | ast.AnnAssign) and node.value]
    values = [list(ast.walk(node.value)) for node in nodes]
    written = [parts for parts in values if all(isinstance(part, NUMERIC) for part in parts)]
    numbers = [[part.value for part in parts if isinstance(part, ast.Constant)] for parts in written]
    return sum(any(type(n) in (int, float) and n not in PLAIN for n in found) for found in numbers)


def main() -> None:
    """Print the table."""
    files = {p.relative_to(ROOT): p.read_text("utf-8") for f in FOLDERS for p in (ROOT / f).rglob("*.py")}
    lines = Counter(path.parts[0] for path, text in files.items() for _ in text.splitlines())
    product = {path: ast.parse(text) for path, text in files.items() if path.parts[0] in PRODUCT}
    modules = {".".join(path.with_suffix("").parts).removesuffix(".__init__") for path in product}
    importers = Counter(name for tree in product.values() for name in list_imports(tree, modules))
    words, share = measure_documents()
    rows = {f"Python, {folder} [lines]": lines[folder] for folder in FOLDERS}
    rows["product Python, without studies and tests [lines]"] = sum(lines[folder] for folder in PRODUCT)
    rows["documents [words]"] = words
    rows[f"sentences over {LONG} words [%]"] = round(100 * share, 1)
    rows["modules that one other imports"] = sum(count == 1 for count in importers.values())
    outside = [count_constants(tree) for path, tree in product.items() if path.parts[0] != "catalogs"]
    rows["numeric constants outside catalogs"] = sum(outside)
    print("\n".join(f"{name:<50} {value:>9,}" for name, value in rows.items()))


if __name__ == "__main__":
    main()
