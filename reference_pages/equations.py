"""Equations as MathML, which browsers draw without a script: for blocks of code that are marked ``math``."""

from typing import Any

from latex2mathml.converter import convert


def format_equation(source: str, *_: Any, **__: Any) -> str:
    """Return an equation as MathML; a formatter of pymdownx.superfences.

    Parameters
    ----------
    source : LaTeX
    """
    lines = [line for line in source.split("\\\\") if line.strip()]
    return "\n".join(
        f'<p class="equation" tabindex="0">{convert(line.strip(), display="block")}</p>' for line in lines
    )
