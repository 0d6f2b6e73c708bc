"""One bit of one file is flipped, again and again: is the file named?"""

import random
from pathlib import Path

from flows.auditing.verify import verify_dataset


def flip_study(dataset: Path, flips: int, seed: int = 6) -> dict[str, int]:
    """Flip bits of a dataset, one at a time, and ask ``verify`` which file is damaged.

    Parameters
    ----------
    dataset : folder of a finished dataset; it is left as it was
    flips : how many; every file has its turn, the bit within it is drawn [1]
    seed : of the bits

    Returns
    -------
    ``flips``, and ``named``: those after which just that file was named
    """
    draw = random.Random(seed)
    files = sorted(path for path in dataset.rglob("*") if path.is_file())
    named = 0
    for turn in range(flips):
        path = files[turn % len(files)]
        original = path.read_bytes()
        content = bytearray(original)
        bit = draw.randrange(8 * len(content))
        content[bit // 8] ^= 1 << bit % 8
        path.write_bytes(content)
        try:
            result = verify_dataset(str(dataset))
        finally:
            path.write_bytes(original)
        damaged = [row["path"] for row in result["damaged"]]
        named += not result["verified"] and damaged == [path.relative_to(dataset).as_posix()]
    return {"flips": flips, "named": named}
