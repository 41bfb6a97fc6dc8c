"""The seal: nothing is read without the key, nothing is altered without being seen, nothing is exchanged afterwards."""

import hashlib
import secrets

import pytest

from thermal_robot.blind.trial import KEY_BYTES, canonical, open_seal, seal
from thermal_robot.errors import SealError, ThermalRobotError

ANSWERS = {"c002": {"truth": {"effects": ["backlash"], "unlisted": None}, "noise": 2.5e-5}, "c001": {"Größe": [1, 2.5]}}


@pytest.fixture
def sealed(tmp_path):
    path, key = tmp_path / "answers.sealed", secrets.token_bytes(KEY_BYTES)
    return path, key, seal(ANSWERS, path, key)


def test_what_was_sealed_is_what_is_opened(sealed):
    assert open_seal(*sealed) == ANSWERS


def test_the_text_is_canonical():
    assert canonical({"b": [1, 2.5, None], "a": "ö"}) == b'{"a":"\\u00f6","b":[1,2.5,null]}'
    assert canonical(dict(reversed(ANSWERS.items()))) == canonical(ANSWERS)
    with pytest.raises(ValueError, match="JSON compliant"):
        canonical({"a": float("nan")})


def test_the_commitment_is_a_hash_that_anyone_can_check_who_has_the_key(sealed):
    _, key, commitment = sealed
    assert commitment == hashlib.sha256(key + canonical(ANSWERS)).hexdigest()


def test_the_file_alone_tells_only_its_length(sealed):
    path, _, _ = sealed
    content = path.read_bytes()
    assert len(content) == len(canonical(ANSWERS))
    for word in (b"backlash", b"c001", b"truth", b"effects"):
        assert word not in content


def test_bytes_of_the_file_are_spread_like_noise(tmp_path):
    path = tmp_path / "sealed"
    seal({"a": "0" * 100_000}, path, bytes(range(KEY_BYTES)))
    content = path.read_bytes()
    counts = [content.count(bytes([k])) for k in range(256)]
    expected = len(content) / 256
    # chi square with 255 degrees of freedom: mean 255, standard deviation 22.6
    assert abs(sum((n - expected) ** 2 / expected for n in counts) - 255) < 5 * 22.6


def test_another_key_gives_another_file_and_another_commitment(sealed, tmp_path):
    path, _, commitment = sealed
    other = seal(ANSWERS, tmp_path / "other", secrets.token_bytes(KEY_BYTES))
    assert other != commitment
    assert (tmp_path / "other").read_bytes() != path.read_bytes()


@pytest.mark.parametrize("at", [0, 40, -1])
def test_an_altered_file_is_refused(sealed, at):
    path, _, _ = sealed
    content = bytearray(path.read_bytes())
    content[at] ^= 1
    path.write_bytes(content)
    with pytest.raises(SealError, match="not the answers that were sealed"):
        open_seal(*sealed)


def test_a_cut_a_longer_and_a_missing_file_are_refused(sealed):
    path, _, _ = sealed
    content = path.read_bytes()
    for other in (content[:-1], content + b"0", b""):
        path.write_bytes(other)
        with pytest.raises(SealError):
            open_seal(*sealed)
    path.unlink()
    with pytest.raises(SealError, match="cannot be read"):
        open_seal(*sealed)


def test_answers_cannot_be_exchanged_together_with_the_key(sealed):
    path, _, commitment = sealed
    key = secrets.token_bytes(KEY_BYTES)
    seal({"c001": {}}, path, key)
    with pytest.raises(SealError):
        open_seal(path, key, commitment)
    assert issubclass(SealError, ThermalRobotError)


def test_a_key_of_another_length_is_refused(tmp_path):
    # the commitment hashes key and text without a mark between them: the length of the key is the mark
    with pytest.raises(ValueError, match="32 bytes"):
        seal(ANSWERS, tmp_path / "sealed", b"short")
