"""Models of one's own in C++: compiled from a header, used like those of the package."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, make_dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from auvest import _core
from auvest._arguments import as_integer, as_number
from auvest.errors import ModelError
from auvest.models import _compile
from auvest.models._base import MeasurementModel, Model, ProcessModel

_FLOAT64 = np.dtype(np.float64)
_LOCK = threading.Lock()
_LOADED: dict[str, LoadedModels] = {}


def load_models(path: str | Path, *, states: Sequence[int] = ()) -> LoadedModels:
    """Compile the models of a C++ header and give their classes.

    They run at the speed of the built-in ones, in float32 and float64, with the bits that the same
    header has on the chip. The compiled library is kept in ``$AUVEST_CACHE``,
    ``$XDG_CACHE_HOME/auvest`` or ``~/.cache/auvest`` until the header changes, so that the first
    load takes some seconds and later ones none.

    Parameters
    ----------
    path : str or Path
        The header: structs that derive from ``auvest::ProcessModel`` or
        ``auvest::MeasurementModel`` (docs/models.md).
    states : sequence of int, optional
        Numbers of states for sensors that are templates over it, beside those of the header's own
        processes; default for a header without a process: 2, 3, 4 and 6, those of the built-in
        processes.

    Returns
    -------
    LoadedModels
        Its attributes are the classes, by the names of the structs.

    Raises
    ------
    ModelError
        If there is no model in the header, no compiler, or the compiler refuses the header; the
        message begins with the line that is wrong.
    FileNotFoundError
        If there is no such file.
    """
    header = Path(path).resolve()
    sizes = sorted({as_integer("states", n, 1, 32) for n in states})
    sources = _compile.sources_of(header)
    found = _compile.find_models(sources[header], header)
    digest = _compile.digest_of(sources, header)
    key = f"{digest}.{'-'.join(str(n) for n in sizes)}"
    with _LOCK:
        if key not in _LOADED:
            prefix = f"{key}."
            code = _compile.generate(found, header.name, prefix, sizes)
            library = _compile.compiled(header, sources, code)
            _core.load_library(str(library))
            described = _description(library)
            _LOADED[key] = LoadedModels(header, digest, tuple(sizes), prefix, described)
        return _LOADED[key]


class LoadedModels:
    """The models of a header: a class each, by the name of its struct.

    Attributes
    ----------
    path : Path
        The header.
    digest : str
        Names the contents of the header and of what it includes from beside it.
    """

    def __init__(
        self,
        path: Path,
        digest: str,
        states: tuple[int, ...],
        prefix: str,
        described: list[_Described],
    ) -> None:
        self.path = path
        self.digest = digest
        self._states = states
        self._classes: dict[str, type[_Loaded]] = {}
        for model in described:
            if model.name not in self._classes:
                self._classes[model.name] = _make_class(self, model, prefix)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        if name not in self._classes:
            known = ", ".join(self._classes)
            raise AttributeError(f"{self.path.name} has no model {name}, but {known}")
        return self._classes[name]

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._classes]

    def __repr__(self) -> str:
        return f"<models of {self.path.name}: {', '.join(self._classes)}>"


class _Loaded(Model):
    """What the classes of loaded models have in common."""

    _models: ClassVar[LoadedModels]
    _core_name: ClassVar[str]

    def __post_init__(self) -> None:
        for entry in fields(self):  # type: ignore[arg-type]
            number = as_number(entry.name, getattr(self, entry.name))
            object.__setattr__(self, entry.name, number)
        try:
            self._try()
        except _core.StatusError:
            raise ValueError(f"check() of the model refuses {self!r}") from None

    def _try(self) -> None:
        """Make the core's model, which checks the parameters."""
        raise NotImplementedError

    @property
    def core_name(self) -> str:
        """Name of the model in the core's registry."""
        return self._core_name

    def description(self) -> dict[str, Any]:
        """Say what the model is, for saved states: its header is named by its contents."""
        return {
            "class": type(self).__name__,
            "header": self._models.digest,
            **self._core_params(),
        }

    def __reduce__(self) -> tuple[Any, ...]:
        models = self._models
        where = (str(models.path), models._states, models.digest)
        return _unpickled, (*where, type(self).__name__, self._core_params())


class _LoadedProcess(_Loaded, ProcessModel):
    def _try(self) -> None:
        self.core(_FLOAT64)


class _LoadedSensor(_Loaded, MeasurementModel):
    _squares = False
    _named: ClassVar[bool]

    def _try(self) -> None:
        self.core(_core.sensor_states(self.core_name)[0], _FLOAT64)

    def _how_for_more(self, states: int) -> str:
        return f"; load_models({self._models.path.name!r}, states=[{states}]) makes it for that"

    def _how_to_name(self, process: ProcessModel) -> str:
        unnamed = self if not self._named else process
        names = " ".join(
            (process.state if not self._named else self.observes)[: len(self.observes)]
        )
        return (
            f"; name the states in the struct {type(unnamed).__name__}: "
            f'static constexpr const char* kStateNames = "{names}";'
        )


@dataclass(frozen=True)
class _Described:
    """What a library says of a model."""

    kind: str
    name: str
    states: int
    size: int  # of its input or its measurement
    observed: int
    place: int
    jacobian: bool
    state_names: tuple[str, ...]
    names: tuple[str, ...]  # of its input or its measurement


def _description(library: Path) -> list[_Described]:
    describe = ctypes.CDLL(str(library)).auvest_describe_models
    describe.restype = ctypes.c_char_p
    described = []
    for line in describe().decode().splitlines():
        kind, name, *numbers, jacobian, state_names, names = line.split("\t")
        states, size, observed, place = (int(number) for number in numbers)
        split = (tuple(state_names.split()), tuple(names.split()))
        described.append(
            _Described(kind, name, states, size, observed, place, jacobian == "1", *split)
        )
    return described


def _make_class(models: LoadedModels, model: _Described, prefix: str) -> type[_Loaded]:
    process = model.kind == "process"
    core_name = prefix + model.name
    defaults = _core.process_defaults if process else _core.sensor_defaults
    base: type[_Loaded] = _LoadedProcess if process else _LoadedSensor
    members: dict[str, Any] = {
        "__doc__": f"{model.name} of {models.path.name}.",
        "__module__": __name__,
        "_models": models,
        "_core_name": core_name,
    }
    if process:
        state = _names(models, model, "kStateNames", model.state_names, model.states, "x")
        members["state"] = state
        members["input"] = _names(models, model, "kInputNames", model.names, model.size, "u")
        members["lacks"] = "" if model.jacobian else "Phi(x, dt)"
    else:
        count = model.observed
        given = model.state_names[:count]  # may name the states that it does not see, too
        members["observes"] = _names(models, model, "kStateNames", given, count, "x")
        members["measures"] = _names(models, model, "kMeasureNames", model.names, model.size, "z")
        members["lacks"] = "" if model.jacobian else "H(x)"
        members["place"] = "place" if model.place else None
        members["_named"] = bool(model.state_names)
    parameters = defaults(core_name)
    for name in parameters:
        if not name.isidentifier() or hasattr(base, name) or name in members:
            raise ModelError(f"{models.path}: {model.name} cannot have a parameter {name!r}")
    return make_dataclass(
        model.name,
        [(name, float, field(default=value)) for name, value in parameters.items()],
        bases=(base,),
        namespace=members,
        frozen=True,
        kw_only=True,
    )


def _names(
    models: LoadedModels,
    model: _Described,
    member: str,
    names: tuple[str, ...],
    count: int,
    letter: str,
) -> tuple[str, ...]:
    if not names:
        return tuple(f"{letter}_{i}" for i in range(count))
    if len(names) != count:
        raise ModelError(
            f"{models.path}: {member} of {model.name} has {len(names)} words, expected {count}"
        )
    return names


def _unpickled(
    path: str, states: tuple[int, ...], digest: str, name: str, params: dict[str, float]
) -> Model:
    """Make a pickled model again, in a process that may not have loaded its header yet."""
    key = f"{digest}.{'-'.join(str(n) for n in states)}"
    models = _LOADED.get(key) or load_models(path, states=states)
    if models.digest != digest:
        raise ValueError(f"{name} was pickled when {path} had other contents")
    return getattr(models, name)(**params)


def from_header(name: str, description: dict[str, Any]) -> Model:
    """Make the model again that described itself; only of headers that are loaded already.

    Raises
    ------
    ValueError
        If its header is not.
    """
    params = dict(description)
    digest = params.pop("header")
    for models in _LOADED.values():
        if models.digest == digest:
            return getattr(models, name)(**params)
    raise ValueError(f"state needs the model {name} of a header that is not loaded; load_models it")
