"""The seal: answers lie in a file that nobody reads before the questions are answered, and nobody changes."""

from __future__ import annotations

import hashlib
import hmac
import json
from pathlib import Path
from typing import Any

from thermal_robot.errors import SealError
from thermal_robot.files import write_bytes

KEY_BYTES = 32


def seal(answers: dict[str, Any], path: Path, key: bytes) -> str:
    """Write answers so that whoever has only the file reads nothing.

    The text is added, byte by byte, to a keystream that SHAKE-256 draws from the key. The key stays in the memory of
    the process that made the answers: without it the file is noise, and only its length is told. A key must serve
    once, since two texts under one keystream would betray their difference. The commitment says that the answers were
    fixed when it was told: nobody finds another text, or another key, with the same hash.

    Parameters
    ----------
    answers
        Plain values; they are written as canonical JSON (see :func:`canonical`).
    path
        File to write.
    key
        32 random bytes.

    Returns
    -------
    str
        The commitment, in hexadecimal: SHA-256 of the key followed by the plain text.
    """
    if len(key) != KEY_BYTES:
        raise ValueError(f"a key has {KEY_BYTES} bytes, not {len(key)}")
    plain = canonical(answers)
    write_bytes(path, _cipher(plain, key))
    return _commitment(plain, key)


def open_seal(path: Path, key: bytes, commitment: str) -> dict[str, Any]:
    """Read what :func:`seal` wrote.

    Parameters
    ----------
    path, key
        As given to :func:`seal`.
    commitment
        As it returned.

    Returns
    -------
    dict
        The answers.

    Raises
    ------
    SealError
        If the file was altered or is missing, or key or commitment are not its own.
    """
    try:
        plain = _cipher(path.read_bytes(), key)
    except OSError as error:
        raise SealError(f"{path}: the sealed answers cannot be read: {error.strerror}") from None
    if not hmac.compare_digest(_commitment(plain, key), commitment):
        raise SealError(
            f"{path}: these are not the answers that were sealed: the commitment {commitment} is not theirs"
        )
    return dict(json.loads(plain))


def canonical(value: Any) -> bytes:
    """Write plain values as the one JSON text that stands for them: sorted keys, no spaces, ASCII, no NaN."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode("ascii")


def _cipher(text: bytes, key: bytes) -> bytes:
    """Encipher, or decipher: adding the same stream twice gives the text back."""
    stream = hashlib.shake_256(key).digest(len(text))
    both = int.from_bytes(text, "big") ^ int.from_bytes(stream, "big")
    return both.to_bytes(len(text), "big")


def _commitment(plain: bytes, key: bytes) -> str:
    return hashlib.sha256(key + plain).hexdigest()
