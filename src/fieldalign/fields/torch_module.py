"""A torch module as a function of places: answers of its own precision and device, derivatives by its autograd.

Nothing here imports torch: who hands a module in has done so.
"""

from __future__ import annotations

import sys
from itertools import chain
from typing import Any

import numpy as np

from .protocol import Floats

_AT_ONCE = 2**14  # places: a wide network keeps some 30 kB for each until its derivative is known


class TorchModule:
    """A torch.nn.Module that takes places (L, 3) to distances (L,) or (L, 1), as a function of NumPy arrays."""

    def __init__(self, module: Any) -> None:
        self._module = module

    def __call__(self, places: Floats) -> Floats:
        """What the module says of the places."""
        with _torch().no_grad():
            return _joined([self._values(some) for some in self._chunks(places)])

    def with_gradient(self, places: Floats) -> tuple[Floats, Floats]:
        """The same, and its derivative (L, 3), from one pass forward and one back."""
        values, gradients, torch = [], [], _torch()
        with torch.inference_mode(False), torch.enable_grad():  # whatever the caller has switched off
            for some in self._chunks(places):
                some.requires_grad_()
                value = self._values(some)
                # Each value depends on its own place alone, so the derivative of the sum holds all of them.
                gradients += torch.autograd.grad(value.sum(), some)
                values.append(value.detach())  # lets go of what the derivative was made from
        return _joined(values), _joined(gradients)

    def gradient(self, places: Floats) -> Floats:
        """The derivative alone (L, 3)."""
        return self.with_gradient(places)[1]

    def _chunks(self, places: Floats) -> Any:
        """The places as tensors of the module's precision, on its device."""
        parts = chain(self._module.parameters(), self._module.buffers())
        own = next((part for part in parts if part.is_floating_point()), _torch().empty(0, dtype=float))
        # A copy: a module that changes what it is given shall not change the places.
        return _torch().tensor(places, dtype=own.dtype, device=own.device).split(_AT_ONCE)

    def _values(self, places: Any) -> Any:
        values = self._module(places)
        return values[:, 0] if values.shape == (len(places), 1) else values


def as_torch_module(function: Any) -> TorchModule | None:
    """The function as a TorchModule, if it is a module of torch."""
    torch = _torch()
    return TorchModule(function) if torch is not None and isinstance(function, torch.nn.Module) else None


def _torch() -> Any:
    """torch, or None where nobody has imported it."""
    return sys.modules.get("torch")


def _joined(chunks: list[Any]) -> Floats:
    # On the processor first: some devices have no double precision, and NumPy has no bfloat16.
    return np.concatenate([chunk.detach().cpu().double().numpy() for chunk in chunks])
