"""Every command with its arguments and options, from the registry that the parser is built from."""

import types
from typing import Any, get_args, get_origin

from flows.commands.command import REQUIRED, Command, Option
from flows.parser import AS_FLOW, AS_JSON, SUBCOMMANDS
from flows.registry import COMMANDS
from reference_pages.markdown import format_table, format_value

VALUES = {str: "text", int: "whole number", float: "number"}
"""What stands for the value of an option of each type."""


def write_commands() -> str:
    """Return a section for daily work and one a group, each command with a table of its options, as Markdown."""
    sections = {"": "\n## Daily work\n"}
    sections |= {word: f"\n## {word}\n\n{sentence}\n" for word, sentence in SUBCOMMANDS.items()}
    for command in COMMANDS:
        sections[command.name.rpartition(" ")[0]] += _describe(command)
    return "".join(sections.values())


def _describe(command: Command) -> str:
    """Return the section of a command."""
    first = [option for option in command.options if option.positional or option.default is REQUIRED]
    words = [f"musync {command.name}", *(_write_usage(option) for option in first)]
    rows = [
        (f"`{_write_name(option)}`", _write_kind(option), _write_default(option), option.help)
        for option in command.options
    ]
    also = [f"`--{AS_JSON.name}`"] if command.output != "nothing" else []
    also += [f"`--{AS_FLOW.name}`"] if command.is_flow else []
    ends = f"\nAlso {' and '.join(also)}.\n" if also else ""
    table = format_table(("option", "value", "default", "meaning"), rows)
    return f"\n### {command.name}\n\n{command.sentence}\n\n    {' '.join(words)} [OPTIONS]\n\n{table}{ends}"


def _write_usage(option: Option) -> str:
    value = option.keyword.upper()
    word = value if option.positional else f"--{option.keyword.replace('_', '-')} {value}"
    return word if option.default is REQUIRED else f"[{word}]"


def _write_name(option: Option) -> str:
    word = option.keyword.replace("_", "-")
    if option.positional:
        return word.upper()
    return f"--{word}/--no-{word}" if option.kind is bool and option.default is True else f"--{word}"


def _write_kind(option: Option) -> str:
    """Return which values an option takes."""
    if isinstance(option.known, tuple) and option.known:
        return ", ".join(f"`{value}`" for value in option.known)
    bounds = [format_value(bound) for bound in (option.minimum, option.maximum)]
    kind = _name_type(option.kind)
    if all(bounds):
        return f"{kind}, {bounds[0]} to {bounds[1]}"
    return f"{kind}, {bounds[0]} and more" if bounds[0] else kind


def _name_type(kind: Any) -> str:
    """Return what stands for a value of a type; nothing for a flag, which takes none."""
    if get_origin(kind) is types.UnionType:
        kind = next(part for part in get_args(kind) if part is not type(None))
    if get_origin(kind) is list:
        return _name_type(get_args(kind)[0])
    if get_origin(kind) is tuple:
        return f"{len(get_args(kind))} {_name_type(get_args(kind)[0])}s"
    return VALUES.get(kind, "")


def _write_default(option: Option) -> str:
    if option.shown_default or option.default is REQUIRED:
        return option.shown_default or "required"
    if option.default is None or option.kind is bool:
        return ""
    return f"`{format_value(option.default)}`"


TABLES = {"commands": write_commands}
"""Function that writes the sections, by the name under which a page asks for them."""
