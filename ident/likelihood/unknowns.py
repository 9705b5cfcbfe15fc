"""What a fit looks for: named blocks of unknowns, shared by all runs or one each.

No index arithmetic outside this file: a block is asked for by its name.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.model.known_values import whitener
from freeswing.cdpr.robot import Array

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Gaussian:
    """What was known of a block before: independent normal entries.

    Attributes:
        mean: (size,).
        std: > 0, infinite where nothing was known, (size,).
        source: who says so, a few words for people.
    """

    mean: Array
    std: Array
    source: str

    def __post_init__(self) -> None:
        mean, std = _frozen(self.mean), _frozen(self.std)
        if mean.shape != std.shape or not (std > 0.0).all():
            raise ValueError(f"prior by {self.source}: mean {mean} and std {std} (all > 0) differ")
        object.__setattr__(self, "mean", mean)
        object.__setattr__(self, "std", std)


@dataclass(frozen=True, slots=True)
class Unknown:
    """One block of unknowns.

    Attributes:
        name: of the block.
        value: (size,), or (runs, size) where each run has its own.
        scale: typical size of a change, > 0, (size,).
        prior: None where nothing is known.
        estimated: whether the block is fitted, or held at its value, (size,).
        each_run: whether each run has values of its own.
        low: bounds that a step does not cross, (size,); None: none.
        high: likewise.
    """

    name: str
    value: Array
    scale: Array
    prior: Gaussian | None = None
    estimated: Mask | None = None
    each_run: bool = False
    low: Array | None = None
    high: Array | None = None

    def __post_init__(self) -> None:
        value = _frozen(self.value)
        if value.ndim != 1 + self.each_run or not np.isfinite(value).all():
            raise ValueError(f"unknown {self.name}: value {value} has a wrong shape or no number")
        size = value.shape[-1]
        scale = _frozen(np.broadcast_to(self.scale, (size,)))
        if not (scale > 0.0).all():
            raise ValueError(f"unknown {self.name}: scale {scale}, must be > 0")
        mask = np.ones(size, dtype=bool) if self.estimated is None else self.estimated
        mask = np.array(np.broadcast_to(mask, (size,)), dtype=bool)
        mask.flags.writeable = False
        for key, bound in (("low", -np.inf), ("high", np.inf)):
            given = getattr(self, key)
            given = np.full(size, bound) if given is None else np.broadcast_to(given, (size,))
            object.__setattr__(self, key, _frozen(given))
        if self.prior is not None and self.prior.mean.shape != (size,):
            raise ValueError(f"unknown {self.name}: {size} values, {self.prior.mean.size} in prior")
        object.__setattr__(self, "value", value)
        object.__setattr__(self, "scale", scale)
        object.__setattr__(self, "estimated", mask)

    @property
    def mask(self) -> Mask:
        """Which of the block's numbers are fitted, (size,)."""
        return np.asarray(self.estimated, dtype=bool)

    @property
    def size(self) -> int:
        """How many numbers (a run)."""
        return int(self.value.shape[-1])

    def is_known_as(self, other: Unknown) -> bool:
        """Whether another differs in nothing but the value."""
        mine, others = self._known, other._known
        alike = (self.name, self.each_run, len(mine)) == (other.name, other.each_run, len(others))
        return alike and all(np.array_equal(a, b) for a, b in zip(mine, others, strict=True))

    @property
    def _known(self) -> list[Array]:
        prior = [] if self.prior is None else [self.prior.mean, self.prior.std]
        return [np.asarray(one) for one in (self.scale, self.mask, self.low, self.high, *prior)]

    def pull(self, value: Array) -> tuple[Array, Array]:
        """Whitened distance from the prior, (size,), and its slope; zero without a prior."""
        if self.prior is None:
            return np.zeros(self.size), np.zeros(self.size)
        return (value - self.prior.mean) / self.prior.std, 1.0 / self.prior.std


@dataclass(frozen=True, slots=True)
class Layout:
    """Where named parts stand in one vector, one after the other: index arithmetic is here.

    Attributes:
        sizes: name and size of each part.
    """

    sizes: tuple[tuple[str, int], ...]

    @property
    def size(self) -> int:
        """Of the whole vector."""
        return sum(size for _, size in self.sizes)

    def joined(self, name: str, size: int) -> Layout:
        """The same with one more part at the end."""
        return Layout((*self.sizes, (name, size)))

    def place(self, name: str) -> slice:
        """Where a part stands.

        Raises:
            ValueError: when none is called so.
        """
        first = 0
        for other, size in self.sizes:
            if other == name:
                return slice(first, first + size)
            first += size
        raise ValueError(f"no shared unknown is called {name!r}")

    def split(self, vector: Array) -> dict[str, Array]:
        """The parts of a vector (..., size)."""
        return {name: vector[..., self.place(name)] for name, _ in self.sizes}


@dataclass(frozen=True, slots=True)
class Unknowns:
    """All blocks of a fit, their names all different.

    Attributes:
        blocks: in the order of the shared unknowns' vector.
        correlations: of what was known before of the shared numbers, in their order, (p, p); None:
            every number is known by itself.
    """

    blocks: tuple[Unknown, ...]
    correlations: Array | None = None

    def __post_init__(self) -> None:
        names = [block.name for block in self.blocks]
        if len(set(names)) < len(names):
            raise ValueError(f"unknowns: a name is there twice in {names}")
        if self.correlations is not None:
            together, size = _frozen(self.correlations), sum(block.size for block in self.shared)
            if together.shape != (size, size):
                raise ValueError(f"unknowns: correlations {together.shape} of {size} numbers")
            object.__setattr__(self, "correlations", together)

    def __contains__(self, name: object) -> bool:
        return any(block.name == name for block in self.blocks)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the blocks, in their order."""
        return tuple(block.name for block in self.blocks)

    @property
    def shared(self) -> tuple[Unknown, ...]:
        """Blocks that all runs have in common."""
        return tuple(block for block in self.blocks if not block.each_run)

    @property
    def own(self) -> tuple[Unknown, ...]:
        """Blocks of which each run has its own."""
        return tuple(block for block in self.blocks if block.each_run)

    def block(self, name: str) -> Unknown:
        """The block of that name.

        Raises:
            ValueError: when there is none.
        """
        for block in self.blocks:
            if block.name == name:
                return block
        raise ValueError(f"no unknown is called {name!r}; there are {', '.join(self.names)}")

    def value(self, name: str) -> Array:
        """Values of a block."""
        return self.block(name).value

    def place(self, name: str) -> slice:
        """Where a block stands among the shared unknowns.

        Raises:
            ValueError: when none is called so.
        """
        return Layout(tuple((block.name, block.size) for block in self.shared)).place(name)

    def columns(self, *names: str) -> NDArray[np.int64]:
        """Where some blocks stand among the shared unknowns, one after the other."""
        nothing = np.zeros(0, dtype=np.int64)
        return np.concatenate([nothing, *(np.r_[self.place(name)] for name in names)])

    def joined(self, *more: Unknown) -> Unknowns:
        """These and further blocks, known by themselves."""
        fewer, all_of = self.correlations, Unknowns((*self.blocks, *more))
        if fewer is None:
            return all_of
        together = np.eye(sum(block.size for block in all_of.shared))
        together[: len(fewer), : len(fewer)] = fewer
        return replace(all_of, correlations=together)

    def without(self, *names: str) -> Unknowns:
        """The same without some blocks."""
        for name in names:
            self.block(name)
        kept = Unknowns(tuple(block for block in self.blocks if block.name not in names))
        if self.correlations is None:
            return kept
        places = self.columns(*(block.name for block in kept.shared))
        return replace(kept, correlations=self.correlations[np.ix_(places, places)])

    def exchanged(self, *others: Unknown) -> Unknowns:
        """The same with other blocks of some names."""
        return self._changed({self.block(one.name).name: one for one in others})

    def held(self, *names: str) -> Unknowns:
        """The same with some blocks held at their values."""
        changed = {name: replace(self.block(name), estimated=np.False_) for name in names}
        return self._changed(changed)

    def all_held(self) -> Unknowns:
        """The same with all that runs share held: what each has for itself is all there is."""
        return self.held(*(block.name for block in self.shared))

    def estimating(self, name: str, mask: Mask) -> Unknowns:
        """The same with those numbers of a block estimated too that a mask (size,) picks."""
        block = self.block(name)
        return self._changed({name: replace(block, estimated=block.mask | mask)})

    def known(self, name: str, prior: Gaussian | None) -> Unknowns:
        """The same with another prior of a block; correlations with others stay."""
        return self._changed({name: replace(self.block(name), prior=prior)})

    def known_together(self, names: Sequence[str], correlations: Array | None) -> Unknowns:
        """The same with what is known of some shared blocks correlated: with these numbers alone.

        Args:
            names: of the blocks.
            correlations: of their numbers, block after block, (q, q); None: none.
        """
        if correlations is None and self.correlations is None:
            return self
        size = sum(block.size for block in self.shared)
        together = np.eye(size) if self.correlations is None else self.correlations.copy()
        places = self.columns(*names)
        together[places] = together[:, places] = 0.0
        together[np.ix_(places, places)] = (
            np.eye(len(places)) if correlations is None else correlations
        )
        return replace(self, correlations=together)

    def known_of(self, *names: str) -> tuple[Array, Array]:
        """Means (q,) of some shared blocks, and what whitens distances from them, (q, q).

        Source:
            Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3: the Gaussian.
        """
        means, stds = [np.zeros(0)], [np.zeros(0)]
        for block in map(self.block, names):
            nothing = Gaussian(np.zeros(block.size), np.full(block.size, np.inf), "nobody")
            prior = block.prior or nothing
            means.append(prior.mean)
            stds.append(prior.std)
        together = self.correlations
        if together is not None:
            places = self.columns(*names)
            together = together[np.ix_(places, places)]
        return np.concatenate(means), whitener(np.concatenate(stds), together)

    def moved(self, values: Mapping[str, Array]) -> Unknowns:
        """The same with other values of some blocks, led back inside their bounds."""
        changed = {}
        for name, value in values.items():
            block = self.block(name)
            changed[name] = replace(block, value=np.clip(value, block.low, block.high))
        return self._changed(changed)

    def of_run(self, run: int) -> dict[str, Array]:
        """The values that a run sees, by block."""
        return {
            block.name: block.value[run] if block.each_run else block.value for block in self.blocks
        }

    def _changed(self, changed: Mapping[str, Unknown]) -> Unknowns:
        blocks = tuple(changed.get(block.name, block) for block in self.blocks)
        return replace(self, blocks=blocks)


def _frozen(values: object) -> Array:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array
