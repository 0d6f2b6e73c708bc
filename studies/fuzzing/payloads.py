"""Mutated text, bytes, Parquet tables and NumPy arrays."""

import csv
import io
import struct
from random import Random
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from studies.fuzzing.rules import Rule

WORDS = (
    "", "nan", "inf", "-inf", "1e999", "1e308", "-1", "0", "x", "1,2", "0x10", "1_0", "٣", "../x",
    "/etc/passwd", "[/red]",
    "\x00", "é", "\u2028", '"', "'", "#", "=1+1", "1" * 5_000, "x" * 100_000, "\x1b[31m", "- ", ": ", "? ",
    "&a ", "*a",
    "{", "[", "|", ">", "%YAML 9", "---", "...", "\t", "!!python/object/apply:os.getcwd []",
)  # fmt: skip
ENCODINGS = ("latin-1", "utf-16", "utf-8-sig", "utf-32", "cp037")
SIZES = (0, 1, 2, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 0x80000000, 10**9)


def odd_text(rng: Random, text: str) -> bytes:
    """Text with lines or words changed, or in another encoding."""
    lines = text.splitlines() or [""]
    k = rng.randrange(len(lines))
    match rng.randrange(9):
        case 0:
            del lines[k]
        case 1:
            lines[k:k] = [lines[k]] * rng.choice([1, 2, 1_000])
        case 2:
            lines[k] = lines[k][: rng.randrange(len(lines[k]) + 1)]
        case 3:
            lines.insert(k, rng.choice(WORDS))
        case 4:
            rng.shuffle(lines)
        case 5:
            return ("é" + text).encode(rng.choice(ENCODINGS), errors="replace")
        case 6:
            lines[k] = rng.choice(["  ", "\t", "", ","]) + lines[k]
        case _:
            words = lines[k].replace(",", " , ").split(" ")
            words[rng.randrange(len(words))] = rng.choice(WORDS)
            lines[k] = " ".join(words).replace(" , ", ",")
    return rng.choice(["\n", "\n", "\n", "\r\n", "\r"]).join(lines).encode()


def broken_cell(rng: Random, text: str, rule: Rule) -> bytes | None:
    """A CSV with a rule broken in one cell; None where it holds in none."""
    rows = list(csv.reader(text.splitlines()))
    under = [
        (i, j)
        for i, row in enumerate(rows[1:], start=1)
        for j, cell in enumerate(row)
        if rule.holds_at((rows[0][j],), _parse_number(cell))
    ]
    if not under:
        return None
    i, j = rng.choice(under)
    rows[i][j] = str(rng.choice(rule.values))
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue().encode()


def broken_word(rng: Random, text: str, rule: Rule) -> bytes | None:
    """Lines of numbers with one of them replaced."""
    lines = text.splitlines()
    under = [
        (i, j) for i, line in enumerate(lines) if not line.startswith("#") for j in range(len(line.split()))
    ]
    if not under:
        return None
    i, j = rng.choice(under)
    words = lines[i].split()
    words[j] = str(rng.choice(rule.values))
    lines[i] = " ".join(words)
    return "\n".join(lines).encode()


def _parse_number(cell: str) -> Any:
    try:
        return float(cell)
    except ValueError:
        return cell


def odd_bytes(rng: Random, content: bytes) -> bytes:
    """Bytes flipped, cut, inserted, repeated, or a length overwritten."""
    data = bytearray(content or b"\0")
    k = rng.randrange(len(data))
    match rng.randrange(8):
        case 0:
            for _ in range(rng.choice([1, 1, 4, 64])):
                data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        case 1:
            del data[k : k + rng.choice([1, 4, 100])]
        case 2:
            data[k:k] = rng.randbytes(rng.choice([1, 4, 100]))
        case 3:
            data[k:k] = data[k : k + 64] * rng.choice([1, 50])
        case 4 | 5:
            # lengths stand at a file's beginning and end more often than in its middle
            k = rng.choice(
                [k, rng.randrange(min(len(data), 64)), len(data) - 1 - rng.randrange(min(len(data), 64))]
            )
            form = rng.choice(["<I", ">I", "<H", "<Q"])
            size = rng.choice(SIZES) & (2 ** (8 * struct.calcsize(form)) - 1)
            data[k : k + struct.calcsize(form)] = struct.pack(form, size)
        case 6:
            data[k : k + 32] = bytes(32)
        case 7:
            data += rng.randbytes(rng.choice([1, 3, 1_000]))
    return bytes(data)


def truncate_content(rng: Random, content: bytes) -> bytes:
    """The beginning of a file, without its last byte or more."""
    return content[: rng.randrange(max(len(content.rstrip()) - 1, 1))]


def odd_header(rng: Random, content: bytes, end: bytes) -> bytes:
    """A file whose text header, up to ``end``, is changed."""
    head, mark, body = content.partition(end)
    return odd_text(rng, head.decode("latin-1")) + b"\n" * (not head.endswith(b"\n")) + mark + body


def odd_array(rng: Random, content: bytes) -> bytes:
    """A .npy whose header announces another shape, type or order, or whose numbers are others."""
    array = np.load(io.BytesIO(content), allow_pickle=False)
    if rng.random() < 0.4:
        return _with_number(rng, array)
    header = {
        "descr": np.lib.format.dtype_to_descr(array.dtype),
        "fortran_order": False,
        "shape": array.shape,
    }
    match rng.randrange(4):
        case 0:
            header["shape"] = rng.choice(
                [(), (0,), (10**12, 3), (2**62, 4), (-1, 3), array.shape[::-1], (1, *array.shape), (len(array) + 1,),
                 (2**31, 2**31, 2**31), (3.5,), ("a",)]
            )  # fmt: skip
        case 1:
            header["descr"] = rng.choice(
                ["|O", "<f8", "<f2", "<i8", "<c16", "|S4", "|V0", "<U100000000", "<M8[s]", "|b1", ">f4", "x", "", 7,
                 [("a", "<f4"), ("b", "|O")]]
            )  # fmt: skip
        case 2:
            header["fortran_order"] = rng.choice([True, 7, "x"])
        case 3:
            header[rng.choice(["more", "shape"])] = rng.choice(["(" * 500, None, "__import__('os')"])
    text = repr(header).encode()
    text += b" " * (-(len(text) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + array.tobytes()


def _with_number(rng: Random, array: np.ndarray) -> bytes:
    flat = array.copy().ravel()
    if flat.size:
        with np.errstate(over="ignore"):
            flat[rng.randrange(flat.size)] = (
                rng.choice([0, 255, 7])
                if flat.dtype.kind in "iu"
                else rng.choice([np.nan, np.inf, -1, 0, 1e38, 1e-38])
            )
    out = io.BytesIO()
    np.save(out, flat.reshape(array.shape))
    return out.getvalue()


def odd_table(rng: Random, content: bytes) -> bytes:
    """A Parquet file whose columns have another type, name, unit or order."""
    table = pq.read_table(pa.BufferReader(content))
    k = rng.randrange(table.num_columns)
    field, column = table.schema.field(k), table.column(k).combine_chunks()
    n = table.num_rows
    match rng.randrange(11):
        case 0:
            table = table.remove_column(k)
        case 1:
            name = rng.choice(
                ['a" , 1) AS "a"', "", "time", "[/red]", "x" * 5_000, "\x00", table.column_names[-1]]
            )
            table = table.rename_columns(
                [name if i == k else old for i, old in enumerate(table.column_names)]
            )
        case 2:
            odd_type = rng.choice(
                [pa.array(["x"] * n), pa.array([None] * n), pa.array([[1.0]] * n), pa.array([{"a": 1}] * n),
                 pa.array([True] * n), pa.array([b"x"] * n), pa.array([0] * n, pa.timestamp("ns")),
                 pa.array(["x"] * n).dictionary_encode(), pa.array([None] * n, pa.float64()), pa.array([2**62] * n),
                 pa.array([1] * n, pa.decimal128(38, 0)), pa.array([0.5] * n, pa.float16())]
            )  # fmt: skip
            table = table.set_column(k, field.name, odd_type)
        case 3:
            table = table.slice(0, rng.choice([0, 1, 2]))
        case 4:
            table = table.append_column(field, column)
        case 5:
            unit = rng.choice([b"furlong", b"", b"\xff\xfe", b"x" * 10_000])
            table = table.cast(table.schema.set(k, field.with_metadata({b"units": unit})))
        case 6:
            table = pa.concat_tables([table, table])
        case 7:
            table = table.select([])
        case 8:
            table = table.select(rng.sample(table.column_names, table.num_columns))
        case 9:
            order = list(range(n))
            rng.shuffle(order)
            table = table.take(order)
        case _ if pa.types.is_floating(column.type) and n:
            values = column.to_numpy(zero_copy_only=False).copy()
            values[rng.randrange(n) :][: rng.choice([1, n])] = rng.choice(
                [np.nan, np.inf, 1e308, -1e308, 0.0]
            )
            table = table.set_column(k, field, [values])
    return _store_table(table)


def broken_column(rng: Random, content: bytes, rule: Rule) -> bytes | None:
    """A Parquet file with a number of a column replaced; None where no column is under the rule."""
    table = pq.read_table(pa.BufferReader(content))
    under = [
        k
        for k, field in enumerate(table.schema)
        if pa.types.is_floating(field.type) and rule.holds_at((field.name,), 0.0) and table.num_rows
    ]
    if not under:
        return None
    k = rng.choice(under)
    values = table.column(k).to_numpy().copy()
    values[rng.randrange(len(values))] = rng.choice(rule.values)
    return _store_table(table.set_column(k, table.schema.field(k), [values]))


def _store_table(table: pa.Table) -> bytes:
    out = io.BytesIO()
    pq.write_table(table, out)
    return out.getvalue()


def odd_numbers(rng: Random, content: bytes) -> bytes:
    """A file of float32 with numbers near its end replaced."""
    data = bytearray(content)
    for _ in range(rng.choice([1, 1, 4, 16])):
        k = len(data) - 4 * rng.randrange(1, len(data) // 8)
        data[k : k + 4] = struct.pack(
            "<f", rng.choice([np.nan, np.inf, -np.inf, 0.0, -1.0, 3e38, 1e-40, 89.0, -200.0])
        )
    return bytes(data)
