"""Effects, drives, sensors and excitations: by class, by id, and with your own."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar

from flexgui.core.drives.drive import Drive
from flexgui.core.effects.effect import Effect
from flexgui.core.errors import InputError
from flexgui.core.excitation.excitation import Excitation
from flexgui.core.plugins import classes_of
from flexgui.core.plugins import register as add_plugin
from flexgui.core.plugins import unregister as remove_plugin
from flexgui.core.sensors.sensor import Sensor
from flexgui.core.sentences import first_sentence
from flexgui.library.shown import looked_up
from flexgui.views.table import Column, Row, Table, html_table

if TYPE_CHECKING:
    import pandas as pd

T = TypeVar("T")
OneEffect: TypeAlias = str | type[Effect] | Effect | Mapping[str, Any]
"""An id, a class, an instance, or a table with an id or a formula."""


class Catalogue(Mapping[str, type[T]], Generic[T]):
    """The classes of one kind of plug-in: `effects["backlash"]` is `effects.Backlash`."""

    def __init__(self, package: str, base: type) -> None:
        self._package, self._base = package, base

    @property
    def _classes(self) -> Mapping[str, type[T]]:
        return classes_of(self._package, self._base)

    def __getitem__(self, kind: str) -> type[T]:
        word = self._base.__name__.lower()
        return looked_up(self._classes, kind, f"The {word} {kind!r} is not known")

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(self._classes))

    def __len__(self) -> int:
        return len(self._classes)

    def __getattr__(self, name: str) -> type[T]:
        for one in self._classes.values():
            if one.__name__ == name:
                return one
        raise AttributeError(f"There is no {self._base.__name__.lower()} class {name}.")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(one.__name__ for one in self._classes.values())]

    def title(self, kind: str) -> str:
        """Say in a line what a plug-in is.

        Args:
            kind: Its id.

        Raises:
            InputError: Where it is not known.
        """
        one = self[kind]
        return str(getattr(one, "title", "")) or first_sentence(inspect.getdoc(one) or "")

    def to_dataframe(self) -> pd.DataFrame:
        """Tabulate id, class and title."""
        import pandas as pd

        return pd.DataFrame(self._rows(), columns=["id", "class", "title"])

    def _rows(self) -> list[tuple[str, ...]]:
        return [(kind, self[kind].__name__, self.title(kind)) for kind in self]

    def __repr__(self) -> str:
        return f"<{self._base.__name__} catalogue: {', '.join(self)}>"

    def _repr_html_(self) -> str:
        rows = tuple(Row(cells) for cells in self._rows())
        return str(html_table(Table((Column("Id"), Column("Class"), Column("What")), rows)))


PACKAGES: dict[type, str] = {
    Effect: "flexgui.core.effects",
    Drive: "flexgui.core.drives",
    Sensor: "flexgui.core.sensors",
    Excitation: "flexgui.core.excitation",
}
"""Contract of a plug-in -> where those that come with FlexGUI are."""

effects: Catalogue[Effect] = Catalogue(PACKAGES[Effect], Effect)
drives: Catalogue[Drive] = Catalogue(PACKAGES[Drive], Drive)
sensors: Catalogue[Sensor] = Catalogue(PACKAGES[Sensor], Sensor)
excitations: Catalogue[Excitation] = Catalogue(PACKAGES[Excitation], Excitation)

C = TypeVar("C", bound=type)


def register(thing: C) -> C:
    """Add an own effect, drive, sensor or excitation; works as a decorator of its class.

    Afterwards scenarios, diagnosis and reports of this process know it by its `kind`.

    Args:
        thing: A subclass of `Effect`, `Drive`, `Sensor` or `Excitation`.

    Returns:
        The class itself.

    Raises:
        InputError: Where it is no such class, has no `kind`, or the `kind` is taken.
    """
    contract = _contract_of(thing)
    add_plugin(PACKAGES[contract], contract, thing)
    return thing


def unregister(thing: type) -> None:
    """Take an own class out again.

    Args:
        thing: A class that was registered.

    Raises:
        InputError: Where it is no subclass of a contract.
    """
    remove_plugin(PACKAGES[_contract_of(thing)], str(getattr(thing, "kind", "")))


def _contract_of(thing: type) -> type:
    for contract in PACKAGES:
        if isinstance(thing, type) and issubclass(thing, contract):
            return contract
    names = ", ".join(contract.__name__ for contract in PACKAGES)
    raise InputError(f"{thing!r} is no subclass of one of {names}; derive it from one.")


def formula(
    target: str, text: str, *, title: str = "", id: str = "", **parameters: Any
) -> dict[str, Any]:
    """State an own effect as a formula, for `effects=` of `project` and `with_effects`.

    Args:
        target: `joint1`, `joint2`, ... (N m, N on a slide), `tip1`, `tip2` (N), or a sensor's
            channel such as `z1`, in its unit.
        text: Of the states `theta1`, `dtheta1`, `delta1` (m), ... and the parameters.
        title: A name to show.
        id: The effect's id; without one `own_1`, `own_2`, ...
        **parameters: Name = start, or = {"start": ..., "unit": ..., "lower": ..., "upper": ...}.

    Returns:
        What `[[model.own]]` of a scenario holds.
    """
    named = {name: value for name, value in (("title", title), ("id", id)) if value}
    return {"target": target, "formula": text, "parameters": parameters, **named}


def model_with(model: Mapping[str, Any], added: Sequence[OneEffect]) -> dict[str, Any]:
    """The table `[model]` with further effects, listed ones and formulas."""
    listed, own = list(model.get("effects", ())), list(model.get("own", ()))
    for one in added:
        entry = _effect_entry(one)
        (own if "formula" in entry else listed).append(entry)
    tables = {"effects": listed, "own": own}
    return {**model, **{name: table for name, table in tables.items() if table}}


def _effect_entry(one: OneEffect) -> dict[str, Any]:
    if isinstance(one, str):
        return {"id": one}
    if isinstance(one, Mapping):
        return dict(one)
    kind = one if isinstance(one, type) else type(one)
    if dict(effects).get(kind.kind) is not kind:
        register(kind)
    return {"id": kind.kind}
