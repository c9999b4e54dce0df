"""Fit a perceptron to what was seen and what should have been done."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrsnake_env.errors import InputError

__all__ = ["Layers", "fitted", "load_torch"]

Float32 = NDArray[np.float32]
Layers = tuple[tuple[Float32, Float32], ...]

WIDTH, BATCH, HUBER = 128, 256, 0.1
"""Of both hidden layers; of a minibatch; and of actions, where the loss turns from square to linear."""

HELD_OUT, BLOCK = 10, 20
"""One in ten stretches of so many steps is held out: steps side by side are nearly the same."""

UPDATES, CHECK = 4000, 200
"""At most so many updates in a fit, and so many between two looks at what is held out."""

FASTEST, SLOWEST = 1e-3, 3e-5
"""Adam's step size falls by half when two looks in a row were no better; below the last the fit ends."""

NARROWEST = 0.01
"""Least scale of an observed number, all of which are in [-1, 1]: some never change in a maze."""


def load_torch() -> Any:
    """Return torch, if it is installed."""
    try:
        import torch
    except ImportError:
        raise InputError('Expected torch to be installed, to imitate: pip install "hrsnake[rl]".') from None
    return torch


def fitted(observations: Float32, actions: Float32, layers: Layers, rng: np.random.Generator) -> Layers:
    """Fit a perceptron with two hidden layers of tanh, until it is no better on what is held out.

    Inputs are scaled by their means and deviations, and the scales put into the first layer afterwards.

    Parameters
    ----------
    observations : float32 array, shape (n_steps, n_observed)
        In the order of the episodes; more than one stretch of steps.
    actions : float32 array, shape (n_steps, n_actions)
        To be returned for them.
    layers : tuple of (weights, bias)
        To begin with, from an earlier fit; without any, new ones are drawn.
    rng : np.random.Generator
        For new layers and minibatches.

    Returns
    -------
    layers : tuple of (weights, bias)
        Those that did best; weights have shape (n_out, n_in).
    """
    torch = load_torch()
    shift, scale = observations.mean(axis=0), np.maximum(observations.std(axis=0), np.float32(NARROWEST))
    net = _network(torch, observations.shape[1], actions.shape[1], int(rng.integers(2**31)))
    if layers:
        _set_layers(torch, net, _rescaled(layers, shift, scale))
    inputs, targets = torch.from_numpy((observations - shift) / scale), torch.from_numpy(actions)
    held = np.arange(len(inputs)) // BLOCK % HELD_OUT == 0
    train, test = torch.from_numpy(np.flatnonzero(~held)), torch.from_numpy(np.flatnonzero(held))
    loss_of = torch.nn.SmoothL1Loss(beta=HUBER)
    adam = torch.optim.Adam(net.parameters(), lr=FASTEST)
    slower = torch.optim.lr_scheduler.ReduceLROnPlateau(adam, factor=0.5, patience=1)
    least, best = np.inf, _layers(net)
    for k in range(1, UPDATES + 1):
        batch = train[torch.from_numpy(rng.integers(len(train), size=BATCH))]
        adam.zero_grad()
        loss_of(net(inputs[batch]), targets[batch]).backward()
        adam.step()
        if k % CHECK == 0:
            with torch.no_grad():
                loss = float(loss_of(net(inputs[test]), targets[test]))
            slower.step(loss)
            if loss < least:
                least, best = loss, _layers(net)
            if adam.param_groups[0]["lr"] < SLOWEST:
                break
    return _rescaled(best, -shift / scale, 1.0 / scale)


def _network(torch: Any, n_in: int, n_out: int, seed: int) -> Any:
    """Return a new perceptron; the random numbers of everybody else stay as they are."""
    nn = torch.nn
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        return nn.Sequential(
            nn.Linear(n_in, WIDTH), nn.Tanh(), nn.Linear(WIDTH, WIDTH), nn.Tanh(), nn.Linear(WIDTH, n_out)
        )


def _layers(net: Any) -> Layers:
    """Copy the weights and biases out of a perceptron."""
    return tuple(
        (part.weight.detach().numpy().copy(), part.bias.detach().numpy().copy()) for part in net[::2]
    )


def _set_layers(torch: Any, net: Any, layers: Layers) -> None:
    """Copy weights and biases into a perceptron."""
    with torch.no_grad():
        for part, (weights, bias) in zip(net[::2], layers, strict=True):
            part.weight.copy_(torch.from_numpy(weights))
            part.bias.copy_(torch.from_numpy(bias))


def _rescaled(layers: Layers, shift: Float32, scale: Float32) -> Layers:
    """Return layers that do with (x - shift) / scale what these do with x."""
    (weights, bias), *others = layers
    return ((weights * scale, bias + weights @ shift), *others)
