"""Hyper-parameters of each method and environment, from files that RL Zoo reads, too."""

from __future__ import annotations

import importlib
import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hrsnake_env.arguments import check_at_least, is_number
from hrsnake_env.errors import InputError
from hrsnake_env.registration import ENVIRONMENTS
from planners.reading import NotReadable, read_limited, shown
from planners.rl.environments import TRAINING_KWARGS, TRAINING_ONLY, WRAPPERS, Wrappers, check_env_id

__all__ = ["CLONING", "FIRST_SEED", "METHODS", "Settings", "load_settings", "settings_file"]

METHODS = ("ppo", "ppo-planned", "ppo-residual", "sac", "tqc", "tqc-her")
"""Each is an algorithm, where its episodes start, and what its actions mean."""

CLONING = ("clone", "dagger")
"""Methods that imitate a planner; they have no files of settings, and observe what "ppo" does."""

FIRST_SEED = 1_000_000
"""Of the first episode of an evaluation, far from those that trainings begin with."""

SETTINGS_BYTES, MOST_VALUES = 2**20, 20_000
"""Of a file of settings."""

FOLDER = Path(__file__).parent / "hyperparams"

ALGORITHMS = {
    "ppo": "ppo",
    "ppo-planned": "ppo",
    "ppo-residual": "ppo",
    "sac": "sac",
    "tqc": "tqc",
    "tqc-her": "tqc",
}
"""RL Zoo's `--algo` for each method's file."""

OFF_POLICY = (
    "batch_size",
    "buffer_size",
    "ent_coef",
    "gamma",
    "gradient_steps",
    "learning_rate",
    "learning_starts",
    "n_steps",
    "policy_kwargs",
    "replay_buffer_class",
    "replay_buffer_kwargs",
    "target_entropy",
    "target_update_interval",
    "tau",
    "train_freq",
)

ARGUMENTS = {
    "ppo": (
        "batch_size",
        "clip_range",
        "ent_coef",
        "gae_lambda",
        "gamma",
        "learning_rate",
        "max_grad_norm",
        "n_epochs",
        "n_steps",
        "normalize_advantage",
        "policy_kwargs",
        "target_kl",
        "vf_coef",
    ),
    "sac": OFF_POLICY,
    "tqc": (*OFF_POLICY, "top_quantiles_to_drop_per_net"),
}
"""What a file may hand to each algorithm of stable-baselines3."""

OWN_KEYS = ("n_timesteps", "n_envs", "policy", "env_wrapper", "env_kwargs")
"""What RL Zoo, and this package, make of an entry themselves."""

NUMBERS = (
    *("batch_size", "buffer_size", "gae_lambda", "gamma", "gradient_steps", "learning_starts"),
    *("max_grad_norm", "n_epochs", "n_steps", "target_kl", "target_update_interval", "tau"),
    *("top_quantiles_to_drop_per_net", "vf_coef"),
)
"""What must be a number in a file."""

POLICIES = ("MlpPolicy", "MultiInputPolicy")

BUFFERS = ("HerReplayBuffer",)

SCHEDULES = ("learning_rate", "clip_range")
"""These may also be written as lin_NUMBER: they then fall to 0 over the run."""

POLICY_KWARGS = ("log_std_init", "n_critics", "n_quantiles", "net_arch")

MAPPINGS = ("env_kwargs", "policy_kwargs", "replay_buffer_kwargs")


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Hold what a method does in an environment.

    Parameters
    ----------
    method : str
        One of `METHODS`, or of `CLONING`.
    env_id : str
        A registered id.
    n_timesteps : int
        Steps of all environments together.
    n_envs : int
        Environments that are stepped in turn.
    policy : str
        The policy class of stable-baselines3.
    env_kwargs : dict
        For `gymnasium.make`.
    wrappers : tuple of (name, arguments)
        Round the environment, innermost first; see `planners.rl.environments.make_env`.
    arguments : dict
        Of the algorithm, as stable-baselines3 names them.
    """

    method: str
    env_id: str
    n_timesteps: int
    n_envs: int = 1
    policy: str = "MlpPolicy"
    env_kwargs: dict[str, Any] = field(default_factory=dict)
    wrappers: Wrappers = ()
    arguments: dict[str, Any] = field(default_factory=dict)

    @property
    def algorithm(self) -> str:
        """The algorithm, as RL Zoo calls it."""
        return ALGORITHMS[self.method]

    @property
    def evaluation_wrappers(self) -> Wrappers:
        """The wrappers without those that only training has."""
        return tuple(entry for entry in self.wrappers if entry[0] not in TRAINING_ONLY)

    @property
    def evaluation_kwargs(self) -> dict[str, Any]:
        """The environment's arguments without those that only training has."""
        return {key: value for key, value in self.env_kwargs.items() if key not in TRAINING_KWARGS}


def settings_file(method: str) -> Path:
    """Return the file with a method's hyper-parameters, for `rl_zoo3.train --conf-file`.

    Raises
    ------
    InputError
        If there is no such method.
    """
    if method in CLONING:
        raise InputError(f"Expected a method with settings ({', '.join(METHODS)}), got {method!r}.")
    if method not in METHODS:
        raise InputError(f"Unknown method {method!r}. Available: {', '.join((*METHODS, *CLONING))}.")
    return FOLDER / f"{method}.yml"


def load_settings(method: str, env_id: str, *, file: str | os.PathLike[str] | None = None) -> Settings:
    """Read the settings of a method for an environment, or its `default` ones.

    Parameters
    ----------
    method : str
        One of `METHODS`.
    env_id : str
        A registered id.
    file : path, optional
        Another file of hyper-parameters (.yml) for the method's algorithm.

    Raises
    ------
    InputError
        If a method, an environment, or what the file holds is unknown, or PyYAML is not installed.
    """
    own = settings_file(method)
    path = own if file is None else Path(file)
    check_env_id(env_id)
    entries = _read(path)
    for name in entries:
        if name != "default" and name not in ENVIRONMENTS:
            raise InputError(f"Expected environments and 'default' in '{path}', got {shown(name)}.")
    if env_id not in entries and "default" not in entries:
        raise InputError(f"Expected settings for {env_id!r} or 'default' in '{path}', but there are none.")
    # A file is refused as a whole: a slip in one entry is found before another run needs it.
    every = {name: _settings(path, method, name, entry) for name, entry in entries.items()}
    found = every[env_id if env_id in every else "default"]
    return Settings(**{**vars(found), "env_id": env_id})


def _read(path: Path) -> dict[str, Any]:
    try:
        yaml: Any = importlib.import_module("yaml")
    except ImportError:
        raise InputError('Expected PyYAML to be installed: pip install "hrsnake[rl]".') from None
    try:
        text = read_limited(path, SETTINGS_BYTES).decode("utf-8")
        if _weight(yaml.compose(text, Loader=yaml.SafeLoader), {}) > MOST_VALUES:
            raise InputError(
                f"Expected at most {MOST_VALUES} values in '{path}', references counted, got more."
            )
        entries = yaml.safe_load(text)
    except FileNotFoundError:
        raise InputError(f"Expected a file of settings (.yml) at '{path}', but there is none.") from None
    except (
        OSError,
        NotReadable,
        ValueError,
        TypeError,
        OverflowError,
        RecursionError,
        yaml.YAMLError,
    ) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"Expected settings (.yml) in '{path}', got a file that is not YAML.") from None
    if not isinstance(entries, dict):
        raise InputError(f"Expected settings by environment in '{path}', got {type(entries).__name__}.")
    return entries


def _weight(node: Any, known: dict[int, float]) -> float:
    """Return how many values a node of YAML stands for: a few references can stand for any number."""
    if not isinstance(getattr(node, "value", None), list):
        return 1.0
    if id(node) not in known:
        known[id(node)] = math.inf  # if it refers to itself
        inner = (each for child in node.value for each in (child if isinstance(child, tuple) else (child,)))
        known[id(node)] = 1.0 + sum(_weight(each, known) for each in inner)
    return known[id(node)]


def _settings(path: Path, method: str, name: str, entry: Any) -> Settings:
    """Check an entry, and sort what it holds."""
    where = f"for {name!r} in '{path}'"
    if not isinstance(entry, dict):
        raise InputError(f"Expected settings {where} as names with values, got {type(entry).__name__}.")
    known = (*OWN_KEYS, *ARGUMENTS[ALGORITHMS[method]])
    for key in entry:
        if key not in known:
            raise InputError(f"Unknown setting {shown(key)} {where}. Available: {', '.join(known)}.")
    for key in MAPPINGS:
        if not isinstance(entry.get(key, {}), dict):
            raise InputError(f"Expected {key} {where} as names with values, got {shown(entry[key])}.")
    for key in ("n_timesteps", "n_envs"):
        if key in entry or key == "n_timesteps":
            check_at_least(f"{key} {where}", entry.get(key), 1, whole=True)
    for key in SCHEDULES:
        _check_schedule(f"{key} {where}", entry.get(key, 0.1))
    for key, value in entry.items():
        if key in NUMBERS and not is_number(value):
            raise InputError(f"Expected {key} {where} as a number, got {shown(value)}.")
    if entry.get("replay_buffer_class", BUFFERS[0]) not in BUFFERS:
        raise InputError(
            f"Unknown replay_buffer_class {shown(entry['replay_buffer_class'])} {where}. "
            f"Available: {', '.join(BUFFERS)}."
        )
    if entry.get("policy", "MlpPolicy") not in POLICIES:
        raise InputError(
            f"Unknown policy {shown(entry['policy'])} {where}. Available: {', '.join(POLICIES)}."
        )
    for key in entry.get("policy_kwargs", {}):
        if key not in POLICY_KWARGS:
            raise InputError(
                f"Unknown policy_kwargs {shown(key)} {where}. Available: {', '.join(POLICY_KWARGS)}."
            )
    return Settings(
        method=method,
        env_id=name,
        wrappers=_wrappers(where, entry.get("env_wrapper")),
        arguments={key: value for key, value in entry.items() if key not in OWN_KEYS},
        **{key: entry[key] for key in OWN_KEYS if key in entry and key != "env_wrapper"},
    )


def _check_schedule(what: str, value: Any) -> None:
    """Refuse what is neither a positive number nor lin_NUMBER; YAML takes 3e-4 for text."""
    try:
        number = float(value.removeprefix("lin_")) if str(value).startswith("lin_") else value
    except ValueError:
        number = value
    if not (is_number(number) and 0.0 < number < math.inf):
        raise InputError(f"Expected {what} as a positive number (0.0003) or lin_0.0003, got {shown(value)}.")


def _wrappers(where: str, value: Any) -> Wrappers:
    """Read wrappers as RL Zoo writes them: a name, a name with arguments, or a list of these."""
    items = [] if value is None else value if isinstance(value, list) else [value]
    wrappers: list[tuple[str, dict[str, Any]]] = []
    for item in items:
        pairs = list(item.items()) if isinstance(item, dict) else [(item, {})]
        named = len(pairs) == 1 and isinstance(pairs[0][0], str) and pairs[0][0] in WRAPPERS
        if not named or not isinstance(pairs[0][1], dict):
            raise InputError(f"Unknown env_wrapper {shown(item)} {where}. Available: {', '.join(WRAPPERS)}.")
        wrappers.append(pairs[0])
    return tuple(wrappers)
