"""From what a scenario says about effects to a model that has them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..arm.arm import Arm, Structure
from ..arm.build import build_arm
from ..drives import build_drive
from ..effects import catalogue, effect, with_included
from ..effects.effect import Effect, EffectParameter
from ..effects.sizes import typical
from ..errors import InputError
from ..model import LEVELS, Model
from ..recording.channels import channel_number
from ..scenario.rig_spec import (
    EffectParameterSpec,
    EffectSpec,
    ModelSpec,
    OwnSpec,
    SensorsSpec,
)
from ..scenario.schema import DiagnoseSpec, IdentifySpec, Scenario
from ..sentences import did_you_mean
from ..validation import finite_number, naming_scenario


@naming_scenario
def base_model(scenario: Scenario) -> Model:
    """With the effects that the scenario states; InputError for one that `[rig]` rules out."""
    model = bare_model(scenario, build_arm(scenario.arm))
    _check_rig(scenario, model.arm.joints)
    return with_stated_effects(model, scenario.model)


def bare_model(scenario: Scenario, arm: Arm) -> Model:
    """Without them, on any arm; a level that is left open is that of the full equations."""
    drive = build_drive(scenario.drive.kind, scenario.drive.options)
    arm = _with_mounts(arm, scenario.sensors)
    level = scenario.model.level
    return Model(arm, drive, level if level in LEVELS else "nonlinear")


def _with_mounts(arm: Arm, stated: SensorsSpec) -> Arm:
    """The arm with the places of its sensors; InputError for one that is on no link of it."""
    for channel, mount in stated.mounts.items():
        k = int(channel_number(channel)) - 1
        where = f"[sensors.{channel}]"
        if k >= arm.joints:
            raise InputError(f"{where} is on link {k + 1}; the arm has {arm.joints} links.")
        length = arm.segments[k].length
        if mount.place is not None and mount.place > length:
            raise InputError(
                f"{where} place is {mount.place:g} m from the joint; link {k + 1} is {length:g} m "
                f"long."
            )
    return arm.model_copy(update={"mounts": tuple(stated.mounts.items())})


WHERE = "[model] effects"


def _check_rig(scenario: Scenario, joints: int) -> None:
    ratios, stated = scenario.rig.gear_ratio, scenario.rig.statements
    if ratios is not None and len(ratios) not in (1, joints):
        raise InputError(
            f"[rig] gear_ratio has {len(ratios)} numbers for {joints} joints; give one for all, or "
            "one each."
        )
    for entry in scenario.model.effects:
        item = catalogue().get(entry.id)
        if item is not None and item.ruled_out_by in stated:
            raise InputError(
                f"{WHERE} lists {entry.id!r}, but [rig] says that {stated[item.ruled_out_by]}; "
                f"remove one of the two."
            )


@dataclass(frozen=True)
class Stated:
    """An effect with what a scenario says of its parameters."""

    effect: Effect
    parameters: Mapping[str, EffectParameterSpec]
    where: str


def with_stated_effects(model: Model, spec: ModelSpec) -> Model:
    """The model with the effects of `[model] effects` and `[[model.own]]`, in that order."""
    stated = stated_effects(model, spec)
    if not stated:
        return model
    quantities, starts = _parameters(model, stated), _starts(stated)
    _check_values(stated, starts, quantities)
    _check_present(stated, starts, quantities)
    return model.with_effects([entry.effect for entry in stated], starts)


def with_hidden_effects(
    model: Model, hidden: Mapping[str, Mapping[str, object]], recording: str
) -> Model:
    """The model behind a simulated recording: the bare model and its hidden effects, without the
    other effects of `model`; InputError for one that is not known."""
    bare = model.bare or model
    effects = {**catalogue(), **{item.kind: item for item in model.effects}}
    stated = []
    for kind, table in hidden.items():
        where = f"Recording {recording}: hidden.{kind}"
        if kind not in effects:
            raise InputError(f"{where} is not known; {did_you_mean(kind, effects)}")
        sizes = {
            name: EffectParameterSpec(start=finite_number(v, f"{where}.{name}"))
            for name, v in table.items()
        }
        stated.append(Stated(effects[kind], sizes, where))
    values = _starts(stated)
    _check_values(stated, values, _parameters(bare, stated))
    return bare.with_effects([entry.effect for entry in stated], values)


def with_effect_parameters(identify: IdentifySpec, model: Model, spec: ModelSpec) -> IdentifySpec:
    """`[identify]` with the parameters of the stated effects that are to be estimated."""
    stated = stated_effects(model, spec)
    if not stated:
        return identify
    settings, quantities = _stated_parameters(stated), _parameters(model, stated)
    neutral = _left_neutral(stated, quantities)
    names, bounds, prior = list(identify.parameters), dict(identify.bounds), dict(identify.prior)
    for name, quantity in _all(quantities).items():
        own = settings.get(name, EffectParameterSpec())
        if not own.vary or name not in model.parameters or name in neutral:
            continue
        if name not in (*names, *identify.per_recording):
            names.append(name)
        if own.lower is not None or own.upper is not None:
            low = quantity.parameter.lower if own.lower is None else own.lower
            high = quantity.parameter.upper if own.upper is None else own.upper
            bounds.setdefault(name, (low, high))
        if own.prior is not None:
            prior.setdefault(name, own.prior)
    update = {"parameters": tuple(names), "bounds": bounds, "prior": prior}
    return identify.model_copy(update=update)


def _left_neutral(
    stated: Sequence[Stated], quantities: Mapping[str, Mapping[str, EffectParameter]]
) -> frozenset[str]:
    """Parameters about separate things of effects of which only others are stated."""
    return frozenset(
        name
        for entry in stated
        if entry.parameters
        for name, quantity in quantities[entry.effect.kind].items()
        if quantity.separate and name not in entry.parameters
    )


def candidate_effects(spec: DiagnoseSpec) -> tuple[Effect, ...]:
    """The effects that a diagnosis may try: those that `[diagnose]` names, else all; InputError for
    a name that is none."""
    if spec.candidates is None:
        return tuple(catalogue().values())
    for kind in spec.candidates:
        if kind not in catalogue():
            hint = did_you_mean(kind, catalogue())
            raise InputError(f"[diagnose] candidates: {kind!r} is not known; {hint}")
    return tuple(effect(kind) for kind in spec.candidates)


def diagnosis_wanted(scenario: Scenario) -> bool:
    """Whether a scenario has a table [diagnose]."""
    return scenario.diagnose.max_effects > 0 or "diagnose" in scenario.model_fields_set


def without_diagnosis(scenario: Scenario) -> Scenario:
    """The scenario without its table [diagnose]."""
    stated = scenario.model_fields_set - {"diagnose"}
    return Scenario.model_construct(stated, **{name: getattr(scenario, name) for name in stated})


def arms_to_compile(scenario: Scenario) -> tuple[Structure, ...]:
    """What must be compiled for a scenario: its arm, and those that a diagnosis will try."""
    model = base_model(scenario)
    candidates = candidate_effects(scenario.diagnose) if diagnosis_wanted(scenario) else ()
    return candidate_structures(model.arm, candidates)


def candidate_structures(arm: Arm, effects: Sequence[Effect]) -> tuple[Structure, ...]:
    """Of an arm by itself and with each of the effects."""
    arms = [arm, *(item.changed_arm(arm, {}) for item in effects)]
    return tuple(dict.fromkeys(Structure.of(item) for item in arms))


def stated_effects(model: Model, spec: ModelSpec) -> list[Stated]:
    """In the order in which they enter the model; InputError for one that is not known."""
    stated = []
    for entry in spec.effects:
        if entry.id not in catalogue():
            hint = did_you_mean(entry.id, catalogue())
            raise InputError(f"{WHERE}: {entry.id!r} is not known; {hint}")
        stated.append(Stated(effect(entry.id), entry.parameters, f"{WHERE} {entry.id}"))
    bare = model.bare or model
    for number, own in enumerate(spec.own, start=1):
        stated.append(_own(bare, own, number))
    _check_once(bare, stated)
    return stated


def fitting(model: Model, spec: ModelSpec) -> ModelSpec:
    """The listed effects without parameters that an arm, such as one that bends less, has not."""
    kept = []
    for entry in spec.effects:
        if entry.id in catalogue():
            quantities = _parameters(model, [Stated(effect(entry.id), {}, WHERE)])
            names = {"id", *_all(quantities)}
            entry = EffectSpec(**{k: v for k, v in dict(entry).items() if k in names})
        kept.append(entry)
    return spec.model_copy(update={"effects": tuple(kept)})


def _own(bare: Model, spec: OwnSpec, number: int) -> Stated:
    from ..effects.own_formula import own_parameter
    from ..effects.own_reading import own_law

    where = f"[[model.own]] {number}"
    kind = spec.id or f"own_{number}"
    if kind in catalogue():
        raise InputError(
            f"{where} id {kind!r} is the id of an effect in the catalogue; choose another."
        )
    parameters = tuple(
        own_parameter(name, quantity.start, quantity.unit, quantity.lower, quantity.upper)
        for name, quantity in spec.parameters.items()
    )
    own = own_law(bare.arm, spec.target, spec.formula, parameters, kind, spec.title or "", where)
    return Stated(own, spec.parameters, where)


def _check_once(bare: Model, stated: Sequence[Stated]) -> None:
    """No effect twice unless it repeats, and no own parameter that is another's."""
    kinds = [entry.effect.kind for entry in stated if not entry.effect.repeats]
    doubled = [kind for kind in kinds if kinds.count(kind) > 1]
    if doubled:
        raise InputError(f"{WHERE} lists {doubled[0]!r} twice; list it once.")
    taken = {**dict.fromkeys(bare.parameters, "the arm or the drive")}
    for entry in stated:
        own = _parameters(bare, [entry])[entry.effect.kind]
        for name in own:
            # A listed effect may be a parameter of the arm; an own one brings its own.
            if entry.effect.kind not in catalogue() and name in taken:
                raise InputError(
                    f"{entry.where} parameters: {name!r} is a parameter of {taken[name]} already; "
                    f"choose another name."
                )
            taken[name] = entry.effect.kind


def _parameters(model: Model, stated: Sequence[Stated]) -> dict[str, dict[str, EffectParameter]]:
    """kind -> name -> parameter, of the effects and all that they include."""
    bare = model.bare or model
    arm, parameters = bare.arm, {}
    for item in with_included([entry.effect for entry in stated]):
        arm = item.changed_arm(arm, {})
        quantities = item.parameters(arm, bare.drive, typical(arm))
        parameters[item.kind] = {quantity.parameter.name: quantity for quantity in quantities}
    return parameters


def _all(quantities: Mapping[str, Mapping[str, EffectParameter]]) -> dict[str, EffectParameter]:
    return {name: quantity for own in quantities.values() for name, quantity in own.items()}


def _stated_parameters(stated: Sequence[Stated]) -> dict[str, EffectParameterSpec]:
    """What all effects together say of parameters; InputError where two say it."""
    parameters: dict[str, EffectParameterSpec] = {}
    for entry in stated:
        for name, quantity in entry.parameters.items():
            if name in parameters:
                raise InputError(f"{entry.where}: {name!r} is given twice; give it once.")
            parameters[name] = quantity
    return parameters


def _starts(stated: Sequence[Stated]) -> dict[str, float]:
    return {
        name: quantity.start
        for name, quantity in _stated_parameters(stated).items()
        if quantity.start is not None
    }


def _check_values(
    stated: Sequence[Stated],
    values: Mapping[str, float],
    quantities: Mapping[str, Mapping[str, EffectParameter]],
) -> None:
    """Only parameters that the effects have, and with the signs that they can have."""
    for entry in stated:
        kinds = [item.kind for item in with_included([entry.effect])]
        own = {name: quantity for kind in kinds for name, quantity in quantities[kind].items()}
        for name in entry.parameters:
            if name not in own:
                hint = did_you_mean(name, own)
                raise InputError(f"{entry.where} has no parameter {name!r}; {hint}")
            if name in values and own[name].parameter.lower >= 0.0 > values[name]:
                raise InputError(
                    f"{entry.where}: {name} is {values[name]:g}; it cannot be less than zero."
                )


def _check_present(
    stated: Sequence[Stated],
    starts: Mapping[str, float],
    quantities: Mapping[str, Mapping[str, EffectParameter]],
) -> None:
    """What is to be estimated must not start where the effect vanishes and is left out."""
    for entry in stated:
        sizes = {n: k for n, k in quantities[entry.effect.kind].items() if not k.secondary}
        vanishes = all(starts.get(n, k.parameter.value) == k.neutral for n, k in sizes.items())
        if (
            sizes
            and vanishes
            and any(entry.parameters.get(n, EffectParameterSpec()).vary for n in sizes)
        ):
            raise InputError(
                f"{entry.where} starts at its neutral value, where it vanishes; give another start "
                f"to at least one of {', '.join(sizes)}."
            )
