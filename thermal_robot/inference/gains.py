"""What one block more would bring a combination, for all blocks at once and to first order: the others stay.

In the eigenvectors of a block's own information beside the others, w, with the vector c there, and with the noise s'²
that it leaves,

    (n + ν) s'² = ν + Q − Σ c² λ²/(s'² + λ² w) ,
    gain(λ) = −½ Σ log(1 + λ² w/s'²) − ½ (n + ν) log(s'²/s₀²) ,

Q = y'y − b'θ, and s₀ the same without the block. A column that cannot be negative has half a normal prior. Where it
would be negative it stays at zero and explains nothing; then, and where it would not, it counts by itself for

    log 2 Φ(z) ,  and at zero beside that  ½ z² − ½ log(1 + λ² w/s'²) ,    z = c λ/(s' (s'² + λ² w)^½) .

with w and c of it beside the others of its block. For a block of one column that is exact.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import erfcx, log_ndtr

from thermal_robot.arrays import Array
from thermal_robot.inference import settings
from thermal_robot.inference.evidence import Combination, Gram

_Sides = tuple[NDArray[np.int64], Array, Array]
_NO_SIDES: _Sides = np.zeros(0, dtype=int), np.zeros(0), np.zeros(0)
_LOG_2, _ROOT_2 = np.log(2.0), np.sqrt(2.0)


@dataclass(frozen=True, eq=False)
class _Alike:
    """Blocks of as many columns: their numbers, w and c² (K, D) of the columns not held at zero, and the sided ones.

    ``sides`` (J,): place in ``blocks``, w and c of each column that cannot be negative.
    """

    blocks: list[int]
    value: Array
    along: Array
    sides: _Sides


def gains(gram: Gram, base: Combination, blocks: Sequence[int]) -> list[tuple[int, float, float]]:
    """Return for each block what adding it gains in log evidence, its scale integrated out, and its best scale."""
    used = gram.columns_of(base.blocks)
    # a column that is held at zero takes nothing up
    kept = np.flatnonzero((base.values != 0.0) | ~gram.positive[used])
    used, values, covariance = used[kept], base.values[kept], base.covariance[kept[:, None], kept] / base.noise**2
    left = gram.vector - gram.matrix[:, used] @ values
    log_scale = np.array(settings.SCALE_GRID)
    square = np.exp(2.0 * log_scale)[:, None]
    step = float(log_scale[1] - log_scale[0])
    freedom = gram.equations + gram.noise_dof
    rest = (gram.noise_dof + gram.total - float(gram.vector[used] @ values)) / freedom
    rest = max(rest, settings.LEAST_VARIANCE * base.noise**2)
    result = []
    for alike in _padded([_beside(gram, base, own, used, left, covariance) for own in _by_width(gram, blocks)]):
        left_over = np.full((len(alike.blocks), len(log_scale)), rest)
        seen, told = square * alike.value[:, None], alike.along[:, None] * square
        part = np.empty_like(seen)
        for _ in range(settings.NOISE_ROUNDS):
            np.add(left_over[:, :, None], seen, out=part)
            taken = np.divide(told, part, out=part).sum(axis=2) / freedom
            left_over = np.maximum(rest - taken, settings.LEAST_VARIANCE * rest)
        spread = gram.spreads[alike.blocks][:, None]
        log = -0.5 * np.log1p(np.divide(seen, left_over[:, :, None], out=part), out=part).sum(axis=2)
        log -= 0.5 * (log_scale / spread) ** 2 + np.log(np.sqrt(2.0 * np.pi) * spread / step)
        log -= 0.5 * freedom * np.log(left_over / rest)
        if gram.most is not None:
            log[log_scale > np.log(gram.most[alike.blocks])[:, None]] = -np.inf
        log += _on_their_sides(alike, square, left_over)
        top = log.max(axis=1)
        gain = top + np.log(np.exp(log - top[:, None]).sum(axis=1))
        result += list(zip(alike.blocks, gain.tolist(), np.exp(log_scale[log.argmax(axis=1)]).tolist(), strict=True))
    return result


def _beside(
    gram: Gram, base: Combination, blocks: list[int], used: NDArray[np.int64], left: Array, covariance: Array
) -> _Alike:
    """Return what blocks of as many columns tell beside the columns in use, of which a covariance is known."""
    own = np.array([np.arange(gram.slices[b].start, gram.slices[b].stop) for b in blocks])
    cross = gram.matrix[own[:, :, None], used]
    inside = gram.matrix[own[:, :, None], own[:, None, :]] - cross @ covariance @ cross.transpose(0, 2, 1)
    pull, free, sides = left[own], np.ones(own.shape, dtype=bool), _NO_SIDES
    if gram.positive[own].any():
        free, sides = _sided(inside, pull, gram.positive[own], base.noise**2)
        inside, pull = inside * (free[:, :, None] & free[:, None, :]), pull * free
    value, vector = np.linalg.eigh(inside)
    along = (vector.transpose(0, 2, 1) @ pull[:, :, None])[:, :, 0] ** 2
    return _Alike(blocks, np.maximum(value, 0.0), along, sides)


def _sided(inside: Array, pull: Array, sided: NDArray[np.bool_], noise2: float) -> tuple[NDArray[np.bool_], _Sides]:
    """Return which columns are not held at zero at their expected sizes, and what each sided one tells by itself.

    A free one with its mean and variance beside all the others that are free, one that is held at zero with the pull
    and the information that these leave it.
    """
    free = ~sided | (pull > 0.0)
    for last in [*(False,) * settings.NOISE_ROUNDS, True]:
        both = free[:, :, None] & free[:, None, :]
        value, vector = np.linalg.eigh(np.where(both, inside, 0.0))
        inverse = (vector / (np.maximum(value, 0.0) + noise2)[:, None, :]) @ vector.transpose(0, 2, 1)
        inverse = np.where(both, inverse, 0.0)
        mean = (inverse @ pull[:, :, None])[:, :, 0]
        rest = pull - (inside @ mean[:, :, None])[:, :, 0]
        wrong = sided & np.where(free, mean < 0.0, rest > 0.0)
        if last or not wrong.any():
            break
        free = free ^ wrong
    taken = (inside @ inverse * inside).sum(axis=2)
    tight = 1.0 / np.where(free, inverse.diagonal(axis1=1, axis2=2), 1.0)
    own = np.where(free, tight - noise2, inside.diagonal(axis1=1, axis2=2) - taken)
    where = np.nonzero(sided)
    return free, (where[0], np.maximum(own, 0.0)[where], np.where(free, mean * tight, rest)[where])


def _on_their_sides(alike: _Alike, square: Array, noise: Array) -> Array:
    """(K, S) what the columns that cannot be negative count for by themselves, at each scale."""
    found = np.zeros_like(noise)
    block, value, pull = alike.sides
    if not len(block):
        return found
    scale2, noise2 = square[:, 0], noise[block]
    seen = scale2 * value[:, None] / noise2
    z = pull[:, None] * np.sqrt(scale2 / (1.0 + seen)) / noise2
    # ½ z² + log 2 Φ(z), which does not underflow where z is far below zero
    at_zero = np.log(erfcx(-np.minimum(z, 0.0) / _ROOT_2)) - 0.5 * np.log1p(seen)
    np.add.at(found, block, np.where(pull[:, None] > 0.0, log_ndtr(np.maximum(z, 0.0)) + _LOG_2, at_zero))
    return found


def _padded(parts: Sequence[_Alike]) -> Iterator[_Alike]:
    """Yield narrow blocks together, with zeros that bring nothing, and wide ones as they are: it is done at once."""
    narrow = [part for part in parts if part.value.shape[1] <= settings.NARROW]
    yield from (part for part in parts if part.value.shape[1] > settings.NARROW)
    if narrow:
        wide = max(part.value.shape[1] for part in narrow)
        first = np.cumsum([0, *(len(part.blocks) for part in narrow)])
        value, along = np.zeros((int(first[-1]), wide)), np.zeros((int(first[-1]), wide))
        for start, part in zip(first, narrow, strict=False):
            rows, columns = slice(start, start + len(part.blocks)), slice(part.value.shape[1])
            value[rows, columns], along[rows, columns] = part.value, part.along
        places = [part.sides[0] + start for start, part in zip(first, narrow, strict=False)]
        seen, pull = (np.concatenate([part.sides[k] for part in narrow]) for k in (1, 2))
        yield _Alike([b for part in narrow for b in part.blocks], value, along, (np.concatenate(places), seen, pull))


def _by_width(gram: Gram, blocks: Sequence[int]) -> list[list[int]]:
    widths: dict[int, list[int]] = {}
    for b in blocks:
        widths.setdefault(gram.slices[b].stop - gram.slices[b].start, []).append(b)
    return list(widths.values())
