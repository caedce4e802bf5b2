"""The registry of drivers: what each can do, and how it is made, without importing it.

A driver is one `CoilDriver`, `ScopeDriver`, `FieldMeterDriver`, `ThermometerDriver` or
`VoltageSourceDriver`. Those of installed distributions are entry points of the group
`tactile_lab.drivers`, named by their kind and name (`scope.ps3000a`); one of the user's
own stands in a Python file that the bench file names (`driver = "my_scope.py"`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any, ClassVar, Generic, TypeVar
from typing import Protocol as Interface

from pydantic import AfterValidator

from tactile_lab.bench import Coil, CoilCapability, Meter
from tactile_lab.clock import Clock
from tactile_lab.errors import (
    LimitError,
    SceneError,
    TactileLabError,
    choices,
    fault_in,
)
from tactile_lab.instruments.channels import check_channels
from tactile_lab.plugins import module_from_file, plugged_in, registered
from tactile_lab.scope import Channel, Scope, ScopeCapability
from tactile_lab.voltage_source import VoltageSource, VoltageSourceCapability

DRIVERS, FAR_ENDS = "tactile_lab.drivers", "tactile_lab.far_ends"
"""Groups of entry points."""

BY_PERSON = "manual"
"""Instead of a field meter's driver: a person is asked what the meter shows."""

MAKING = ("make", "simulated")
"""What of a driver makes the instrument."""

Instrument = TypeVar("Instrument", covariant=True)
D = TypeVar("D", bound="Driver[Any]")


class InstrumentTable(Interface):
    """An instrument's table of a bench file, such as `[coil]`."""

    @property
    def driver(self) -> str:
        """Name of its driver, or path of a Python file with one."""
        ...

    @property
    def options(self) -> Mapping[str, Any]:
        """Keys of the driver's own."""
        ...


@dataclass(frozen=True, kw_only=True)
class Driver(Generic[Instrument]):
    """One driver.

    Attributes:
        make: makes the instrument that a table describes, on a clock; opens nothing.
        simulated: makes it with its simulated far end in a `sim_backend.world.World`;
            None where there is none, or where it is registered by itself.
        options: names of the keys of its own in the table's `options`.
    """

    kind: ClassVar[str]
    interface: ClassVar[type]
    make: Callable[[Any, Clock], Instrument]
    simulated: Callable[[Any, Any], Instrument] | None = None
    options: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse by TypeError what cannot be called."""
        for name, value in vars(self).items():
            if name != "options" and value is not None and not callable(value):
                raise TypeError(f"{name} = {value!r} must be a function")


@dataclass(frozen=True, kw_only=True)
class CoilDriver(Driver[Coil]):
    """A driver of current sources.

    Attributes:
        capability: what the source that a table describes can do; refuses by
            SceneError limits that it cannot.
    """

    kind: ClassVar[str] = "coil"
    interface: ClassVar[type] = Coil
    capability: Callable[[Any], CoilCapability]


@dataclass(frozen=True, kw_only=True)
class ScopeDriver(Driver[Scope]):
    """A driver of oscilloscopes.

    Attributes:
        capability: what the scope that a table describes can do.
        check_rate: refuses by LimitError a rate, S/s, that the scope cannot try; None
            for one that cannot exceed `ScopeCapability.fastest`.
    """

    kind: ClassVar[str] = "scope"
    interface: ClassVar[type] = Scope
    capability: Callable[[Any], ScopeCapability]
    check_rate: Callable[[float], None] | None = None


@dataclass(frozen=True, kw_only=True)
class FieldMeterDriver(Driver[Meter]):
    """A driver of teslameters."""

    kind: ClassVar[str] = "field_meter"
    interface: ClassVar[type] = Meter


@dataclass(frozen=True, kw_only=True)
class ThermometerDriver(Driver[Meter]):
    """A driver of thermometers.

    Attributes:
        check: refuses by SceneError a table whose thermometer cannot do what it says.
    """

    kind: ClassVar[str] = "thermometer"
    interface: ClassVar[type] = Meter
    check: Callable[[Any], object] = lambda table: None


@dataclass(frozen=True, kw_only=True)
class VoltageSourceDriver(Driver[VoltageSource]):
    """A driver of source meters that hold a voltage.

    Attributes:
        capability: what the source that a table describes can do; refuses by
            SceneError limits that it cannot.
    """

    kind: ClassVar[str] = "voltage_source"
    interface: ClassVar[type] = VoltageSource
    capability: Callable[[Any], VoltageSourceCapability]


def driver_names(kind: type[Driver[Any]]) -> tuple[str, ...]:
    """Names of the registered drivers of a kind, sorted; imports none of them."""
    parts = (name.partition(".") for name in registered(DRIVERS))
    return tuple(sorted(name for start, _, name in parts if start == kind.kind))


def find_driver(kind: type[D], table: InstrumentTable) -> D:
    """The driver that an instrument's table names.

    Raises:
        SceneError: there is none of that name or in that file, or the table has an
            option that it does not know.
    """
    name = table.driver
    if name.endswith(".py"):
        driver = _from_file(kind, Path(name))
    else:
        _check_name(kind, (), name)
        driver = plugged_in(DRIVERS, f"{kind.kind}.{name}")
    if not isinstance(driver, kind):
        raise SceneError(f'driver "{name}" is registered as no {kind.__name__}.')
    for key in table.options:
        if key not in driver.options:
            raise SceneError(
                f'[{kind.kind}.options] has no key "{key}" for driver "{name}"; '
                + choices(key, driver.options)
            )
    return driver


def far_end(
    kind: type[Driver[Instrument]], table: InstrumentTable
) -> Callable[[Any, Any], Instrument]:
    """What makes an instrument with its simulated far end, from its table and world.

    Raises:
        SceneError: the driver has no simulated far end.
    """
    driver = find_driver(kind, table)
    if driver.simulated is not None:
        return driver.simulated
    name = f"{kind.kind}.{table.driver}"
    if name not in registered(FAR_ENDS):
        raise SceneError(
            f'[{kind.kind}] driver "{table.driver}" has no simulated far end, so it '
            "cannot stand on a simulated bench; docs/how-to/add-a-driver.md shows one."
        )
    made: Callable[[Any, Any], Instrument] = plugged_in(FAR_ENDS, name)
    return made


def coil_capability(table: InstrumentTable) -> CoilCapability:
    """What a source can do, as far as is known before it is opened.

    Raises:
        SceneError: no such driver or dialect, or a limit beyond the source's rating.
    """
    return find_driver(CoilDriver, table).capability(table)


def scope_capability(table: InstrumentTable) -> ScopeCapability:
    """What a scope can do, as far as is known before it is opened.

    Raises:
        SceneError: no such driver or dialect.
    """
    return find_driver(ScopeDriver, table).capability(table)


def voltage_capability(table: InstrumentTable) -> VoltageSourceCapability:
    """What a voltage source can do within its limits.

    Raises:
        SceneError: no such driver or dialect, or limits beyond the source.
    """
    return find_driver(VoltageSourceDriver, table).capability(table)


def check_thermometer(table: InstrumentTable) -> None:
    """Refuse what a thermometer cannot do.

    Raises:
        SceneError: no such driver, dialect or input.
    """
    find_driver(ThermometerDriver, table).check(table)


def check_scope(
    table: InstrumentTable, channels: Sequence[Channel], rate: float
) -> float:
    """Check that a scope can be set so; the rate it is sure to keep, S/s.

    Args:
        table: names the driver.
        channels: to enable, at least one.
        rate: asked for, S/s.

    Raises:
        LimitError: an input, range, offset, coupling or rate the scope does not have.
    """
    driver = find_driver(ScopeDriver, table)
    capability = driver.capability(table)
    check_channels(channels, capability)
    fastest = capability.fastest[min(len(channels), len(capability.fastest)) - 1]
    if driver.check_rate is not None:
        driver.check_rate(rate)
    elif rate > fastest:
        raise LimitError(
            f"{rate:g} S/s on {len(channels)} channels is beyond the scope's "
            f"{fastest:g} S/s. Lower record.sample_rate."
        )
    return float(fastest)


def _check_name(kind: type[Driver[Any]], others: Iterable[str], name: str) -> str:
    known = (*driver_names(kind), *others)
    if name in known or name.endswith(".py"):
        return name
    what = kind.kind.replace("_", " ")
    raise SceneError(
        f'there is no {what} driver "{name}"; {choices(name, known)} A path ending in '
        ".py names one of your own."
    )


CoilDriverName = Annotated[str, AfterValidator(partial(_check_name, CoilDriver, ()))]
ScopeDriverName = Annotated[str, AfterValidator(partial(_check_name, ScopeDriver, ()))]
MeterDriverName = Annotated[
    str, AfterValidator(partial(_check_name, FieldMeterDriver, (BY_PERSON,)))
]
ThermometerDriverName = Annotated[
    str, AfterValidator(partial(_check_name, ThermometerDriver, ()))
]
VoltageDriverName = Annotated[
    str, AfterValidator(partial(_check_name, VoltageSourceDriver, ()))
]
"""Names in bench files: of a registered driver, or the path of a Python file."""


def _from_file(kind: type[D], path: Path) -> D:
    changed = path.stat().st_mtime_ns if path.is_file() else 0
    module = _module(path, changed)
    found = [one for one in vars(module).values() if isinstance(one, kind)]
    if len(found) != 1:
        raise SceneError(
            f"{path} must hold one {kind.__name__} (tactile_lab.instruments.registry) "
            f"for [{kind.kind}]; it holds {len(found)}."
        )
    driver = found[0]
    told: dict[str, Any] = {
        name: _telling(path, one, driver.interface if name in MAKING else None)
        for name, one in vars(driver).items()
        if callable(one)
    }
    return replace(driver, **told)


def _telling(
    path: Path, function: Callable[..., Any], interface: type | None
) -> Callable[..., Any]:
    """A function of a user's file, whose mistakes are told with file and line.

    Args:
        path: of the file.
        function: to be called.
        interface: whose methods the instrument that it makes must have.
    """

    def telling(*given: Any) -> Any:
        try:
            made = function(*given)
        except TactileLabError:
            raise
        except (Exception, SystemExit) as reason:  # of the user's own
            said = fault_in(path.resolve(), reason)
            raise SceneError(f"Driver file {path} fails: {said}") from reason
        if interface is not None:
            _check_methods(path, made, interface)
        return made

    return telling


def _check_methods(path: Path, made: Any, interface: type) -> None:
    for name, method in vars(interface).items():
        if callable(method) and name[0] != "_" and not hasattr(made, name):
            raise SceneError(
                f"Driver file {path}: {type(made).__name__} has no {name}(), which a "
                f"{interface.__name__} needs (tactile_lab/bench.py)."
            )


@cache
def _module(path: Path, changed: int) -> ModuleType:
    """The file as it was when last changed, at `changed` in ns."""
    return module_from_file(path, "Driver")
