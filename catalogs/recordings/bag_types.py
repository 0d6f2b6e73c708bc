"""Message types of a bag, and unpacking of its pieces, within bounds: rosbags makes Python code of the types' names.

Only definitions whose names are plain identifiers and whose arrays are short reach rosbags' code generator.
"""

import bz2
import re
from collections.abc import Callable
from typing import Any

from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat, Nodetype
from rosbags.interfaces.typing import FieldDesc, Typesdict
from rosbags.rosbag1 import reader as rosbag1_reader
from rosbags.rosbag2 import storage_mcap
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from catalogs.sentences import shorten
from tasks.errors import InputError

LARGEST_DEFINITION = 2**20
"""Characters of a message's definition [1]; the largest of ROS's own messages has 30,000."""
LONGEST_ARRAY = 10_000
"""Elements of an array of fixed length that holds messages or text [1]."""
LARGEST_CHUNK = 2**28
"""Bytes of a packed piece of a bag when unpacked [1]; recorders write pieces of about 1 MB."""
_TYPE_NAME = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*)*", re.ASCII)
_FIELD_NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)


def make_type_store(definition: MessageDefinition, message_type: str) -> Typestore:
    """Return the types that a bag defines for a message, or ROS 2's own where it defines none.

    Parameters
    ----------
    definition : text in the bag
    message_type : name of the message

    Raises
    ------
    InputError
        If a name is no identifier, or a definition is too large.
    """
    if definition.format == MessageDefinitionFormat.NONE:
        return get_typestore(Stores.ROS2_HUMBLE)
    if len(definition.data) > LARGEST_DEFINITION:
        raise InputError(
            f"message {shorten(message_type, 60)}: must be defined in at most {LARGEST_DEFINITION} characters"
        )
    types = _parse_definition(definition, message_type)
    # constants are no signals, and their values would be code
    fields: Typesdict = {name: ([], fields) for name, (_, fields) in types.items()}
    if problems := [
        problem for name, (_, found) in fields.items() if (problem := _find_type_problem(name, found))
    ]:
        raise InputError(problems)
    store = get_typestore(Stores.EMPTY)
    store.register(fields)
    return store


def _parse_definition(definition: MessageDefinition, message_type: str) -> Typesdict:
    if definition.format == MessageDefinitionFormat.MSG:
        return get_types_from_msg(definition.data, message_type)
    separator = "=" * 80 + "\n"
    types: Typesdict = {}
    for part in definition.data.split(separator):
        text = part.partition("\n")[2] if part.startswith("IDL: ") else part
        if text.strip():
            types |= get_types_from_idl(text)
    return types


def _find_type_problem(name: str, fields: list[tuple[str, FieldDesc]]) -> str:
    """Return what is wrong with a type; empty if nothing is."""
    if not _TYPE_NAME.fullmatch(name):
        return f"message {shorten(name, 60)}: must have a name of letters, digits and underscores"
    for field, description in fields:
        whole: Any = description
        kind, inner = whole
        element = inner[0] if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE) else whole
        if not _FIELD_NAME.fullmatch(field) or (
            element[0] == Nodetype.NAME and not _TYPE_NAME.fullmatch(element[1])
        ):
            return f"message {name}: field {shorten(field, 60)} must have names of letters, digits and underscores"
        plain = element[0] == Nodetype.BASE and element[1][0] not in ("string", "wstring")
        if kind == Nodetype.ARRAY and not plain and inner[1] > LONGEST_ARRAY:
            return (
                f"message {name}: field {field} must have at most {LONGEST_ARRAY} elements; it has {inner[1]}"
            )
    return ""


def bound_unpacking() -> None:
    """Make rosbags unpack no more than `LARGEST_CHUNK` bytes at once, whatever a few packed bytes claim."""
    from lz4.frame import LZ4FrameDecompressor

    lz4 = _make_bounded(LZ4FrameDecompressor)
    storage_mcap.DECOMPRESSORS["lz4"] = lz4
    storage_mcap.DECOMPRESSORS["zstd"] = _make_bounded(storage_mcap.zstd.ZstdDecompressor)
    rosbag1_reader.decompressors["lz4"] = lz4
    rosbag1_reader.decompressors["bz2"] = _make_bounded(bz2.BZ2Decompressor)


def _make_bounded(make: Callable[[], Any]) -> Callable[..., bytes]:
    def unpack(packed: bytes, size: int = LARGEST_CHUNK) -> bytes:
        """Unpack one piece, of ``size`` bytes where the bag says so [1]."""
        unpacker = make()
        content: bytes = unpacker.decompress(packed, max_length=min(size, LARGEST_CHUNK) + 1)
        if not unpacker.eof:
            raise InputError(
                f"must be packed in whole pieces of at most {LARGEST_CHUNK} bytes; one is larger or cut off"
            )
        return content

    return unpack
