"""Checked construction of settings: numbers of a size that arithmetic survives, and a pydantic
error as one sentence."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from numbers import Real
from typing import Annotated, Any, Concatenate, ParamSpec, Protocol, TypeVar, cast

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from pydantic._internal._model_construction import ModelMetaclass

from .errors import InputError
from .field_texts import FieldDoc
from .sentences import did_you_mean, one_line, predicate, quoted

M = TypeVar("M", bound=BaseModel)


def gathered(table: Any, beside: Callable[[str], bool], field: str) -> Any:
    """A table of a file with the keys for which `beside` is true put into the table `field`; what
    is no table is left as it is."""
    if not isinstance(table, dict):
        return table
    moved = {k: v for k, v in table.items() if beside(k)}
    others = {k: v for k, v in table.items() if not beside(k)}
    return {**others, field: {**others.get(field, {}), **moved}} if moved else others


def validated(
    kind: type[M], options: Mapping[str, Any], where: str, beside: Iterable[str] = ()
) -> M:
    """`kind(**options)`; the first fault is an InputError of one sentence that starts with `where`.
    `beside` are further settings of the same table."""
    try:
        return kind.model_validate(dict(options))
    except ValidationError as error:
        raise InputError(_first_fault(error, where, [*kind.model_fields, *beside])) from None


def _first_fault(error: ValidationError, where: str, settings: Iterable[str]) -> str:
    faults: list[Any] = list(error.errors(include_url=False))
    fault = next((f for f in faults if f["type"] == "extra_forbidden"), faults[0])
    key = ".".join(str(part) for part in fault["loc"])
    if fault["type"] == "extra_forbidden":
        return one_line(f"{where} {key} is not a setting; {did_you_mean(key, settings)}")
    return one_line(f"{where} {key} {predicate(fault)}")


class Titled(Protocol):
    """What has a title, as a scenario has."""

    @property
    def title(self) -> str:
        """By which a person knows it."""


S = TypeVar("S", bound=Titled)
P = ParamSpec("P")
R = TypeVar("R")


def naming_scenario(function: Callable[Concatenate[S, P], R]) -> Callable[Concatenate[S, P], R]:
    """The function with InputErrors that begin with the scenario's title, its first argument."""

    @wraps(function)
    def named(scenario: S, /, *given: P.args, **settings: P.kwargs) -> R:
        name = f"Scenario {quoted(scenario.title)}: "
        try:
            return function(scenario, *given, **settings)
        except InputError as error:
            raise InputError(name + str(error).removeprefix(name)) from None

    return named


def finite_number(value: object, where: str) -> float:
    """A user's value as a finite number; InputError begins with `where`."""
    if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
        raise InputError(f"{where} is {quoted(value)}; it must be a number.")
    return float(value)


class _OneSentence(ModelMetaclass):
    """Of classes that scripts call: a fault is one InputError instead of several lines of
    pydantic."""

    def __call__(self, *positional: Any, **options: Any) -> Any:
        try:
            return super().__call__(*positional, **options)
        except ValidationError as error:
            settings = cast(type[BaseModel], self).model_fields
            raise InputError(_first_fault(error, self.__name__, settings)) from None

    @property
    def __doc__(self) -> str:  # type: ignore[override]
        """What the class says of itself, with its settings."""
        return FieldDoc(vars(self).get("__doc__")).__get__(None, self)

    def __dir__(self) -> list[str]:
        """Without what all pydantic models have, so that `help()` lists what is FlexGUI's."""
        return [n for n in super().__dir__() if n[0] != "_" and not hasattr(BaseModel, n)]


class Stated(BaseModel, metaclass=_OneSentence):
    """A part of a rig as a script or a scenario states it: frozen, with no key that is not known.
    Made by hand with a wrong setting it raises an InputError that names class and setting."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Its signature without pydantic's annotations: `help()` has them in words."""
        bare = inspect.signature(cls).parameters.values()
        plain = [parameter.replace(annotation=parameter.empty) for parameter in bare]
        cls.__signature__ = inspect.Signature(plain)


LARGEST, SMALLEST = 1e15, 1e-15
"""SI. Young's modulus of diamond is 1.2e12 Pa and the inertia of a watch's hand 1e-12 kg m^2;
squares and products of a few numbers of these sizes are still far from overflow (1e308)."""


def _not_tiny(value: float) -> float:
    if 0.0 < value < SMALLEST:
        raise ValueError(f"is {value:g}; it must be at least {SMALLEST:g}.")
    return value


Bounded = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=LARGEST, allow_inf_nan=False), AfterValidator(_not_tiny)]
NonNegative = Annotated[
    float, Field(ge=0, le=LARGEST, allow_inf_nan=False), AfterValidator(_not_tiny)
]
