"""Counter-based random numbers: any cell of any field can be drawn alone, in any order, with the same bits."""

import hashlib

import numba
import numpy as np

_LOW = np.uint64(0xFFFFFFFF)
_MULTIPLIER_0, _MULTIPLIER_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL_0, _WEYL_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_WORD = np.uint64(32)
_TO_UNIT = 2.0**-32

_MIX_1, _MIX_2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_STRIDE_X, _STRIDE_Y = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xC2B2AE3D27D4EB4F)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_TO_UNIT_53 = 2.0**-53


def stream_key(seed: int, stream: str) -> int:
    """The 64-bit key of one named stream of a seed.

    Parameters
    ----------
    seed : the clip's visual seed; negative numbers and numbers beyond 64 bits are allowed [1]
    stream : name of the field that is drawn, such as ``"rain"``

    Returns
    -------
    int
        Key in [0, 2^64) [1].
    """
    digest = hashlib.blake2b(f"{seed}/{stream}".encode(), digest_size=8).digest()
    return int.from_bytes(digest, "little")


def unit_number(seed: int, stream: str) -> float:
    """One number in [0, 1) of a named stream of a seed, for what a clip draws once [1].

    Parameters
    ----------
    seed, stream : see `stream_key`
    """
    return (stream_key(seed, stream) >> 11) * 2.0**-53


@numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")
def philox(c0, c1, c2, c3, key):  # type: ignore[no-untyped-def]
    """Philox4x32-10 (Salmon et al. 2011, doi:10.1145/2063384.2063405).

    Parameters
    ----------
    c0, c1, c2, c3 : uint64 counter words, each below 2^32 [1]
    key : uint64 [1]

    Returns
    -------
    tuple of four uint64 below 2^32 [1]
    """
    k0, k1 = key & _LOW, key >> _WORD
    for _ in range(10):
        p0, p1 = _MULTIPLIER_0 * c0, _MULTIPLIER_1 * c2
        c0, c1, c2, c3 = (p1 >> _WORD) ^ c1 ^ k0, p1 & _LOW, (p0 >> _WORD) ^ c3 ^ k1, p0 & _LOW
        k0, k1 = (k0 + _WEYL_0) & _LOW, (k1 + _WEYL_1) & _LOW
    return c0, c1, c2, c3


@numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")
def scale_to_unit(word):  # type: ignore[no-untyped-def]
    """A uint64 word below 2^32 as a number in the open interval (0, 1) [1]."""
    return (float(word) + 0.5) * _TO_UNIT


@numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")
def lattice_unit(x, y, key):  # type: ignore[no-untyped-def]
    """One number in [0, 1) for each node of an integer lattice.

    The finaliser of SplitMix64 (Steele et al. 2014, doi:10.1145/2714064.2660195): a tenth of the cost of
    `philox`, for fields that every pixel of every frame reads.

    Parameters
    ----------
    x, y : int64 node [1]
    key : uint64 [1]

    Returns
    -------
    float64 [1]
    """
    h = key ^ (np.uint64(x) * _STRIDE_X) ^ (np.uint64(y) * _STRIDE_Y)
    h = (h ^ (h >> _S30)) * _MIX_1
    h = (h ^ (h >> _S27)) * _MIX_2
    h = h ^ (h >> _S31)
    return (
        np.float64(np.int64(h >> _S11)) * _TO_UNIT_53
    )  # signed: vector units of most processors convert no other
