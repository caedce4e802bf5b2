"""From a scene file, a protocol file or nothing to a validated `Scene`."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

from tactile_lab import trust
from tactile_lab.columns import read_text
from tactile_lab.complaint import Blame, complaint, validated, written
from tactile_lab.errors import SceneError, choices, nearest, to_type
from tactile_lab.plugins import (
    protocol_class,
    protocol_from_file,
    scene_names,
    scene_path,
)
from tactile_lab.quantity import show
from tactile_lab.scene import overrides as options
from tactile_lab.scene.bench_file import BenchSpec, is_file
from tactile_lab.scene.overrides import Overrides
from tactile_lab.scene.scene import Scene
from tactile_lab.scene.sensor import Sensor, with_preset
from tactile_lab.scene.tables import CoilUse, Conditions, Detect, Record, Simulated
from tactile_lab.signals import SIGNALS
from tactile_lab.table import dumped
from tactile_lab.trial import Protocol

TABLES = (
    "protocol", "bench", "sensor", "record", "detect", "coil", "simulated",
    "conditions",
)  # fmt: skip
OTHERS = {"want": "design", "axis": "study", "array": "skin"}
"""Tables that no scene has, and the verbs that take files with them."""
DEMO = "demo"
SIMULATED = "sim"
"""Name of the built-in simulated bench."""
DEAD = {"field_meter": ("interval",)}
"""Keys of a bench that nobody ever read; runs and bench files of before have them."""
MOVED = {
    "input_bias": ("followers", "input_bias"),
    "coil_lag": ("magnet", "coil_lag"),
    "eddy_lag": ("magnet", "eddy_lag"),
}
"""Keys of ``[simulated]`` that are the bench's now: table and key there; scenes and
runs of before have them."""


def load(
    scene: str | Path | Scene | None = None,
    overrides: Overrides = (),
    bench: str | Path | None = None,
    unless_named: str | Path = SIMULATED,
) -> Scene:
    """A scene, validated; opens no instrument and writes nothing.

    Args:
        scene: a scene file (TOML), a protocol file (.py), the name of a scene that
            ships, a scene that was loaded, or None for the demo.
        overrides: change single keys: ``{"protocol.level": 0.12}``, with quantities as
            SI numbers or texts ("120 mN"), or ``table.key=value`` texts.
        bench: path of a bench file, or "sim" for the built-in simulated bench; replaces
            the scene's own ``[bench]``.
        unless_named: the same, where the scene has no ``[bench]``; never for the demo
            that is nobody's choice (`scene` None).

    Raises:
        SceneError: something cannot be used as written; names file, key, value, what is
            allowed and the nearest valid key.
    """
    for what, given in (("scene", scene), ("bench", bench)):
        if given is not None and not isinstance(given, str | Path | Scene):
            raise SceneError(
                f"{what} = {given!r}: a name or the path of a file is needed; "
                "single keys are changed by the second argument."
            )
    if isinstance(scene, Scene):
        if not overrides and bench is None:
            return scene
        file, name = scene.path or Path(f"{scene.name}.toml"), scene.name
        data = scene.to_dict()
    else:
        file = _find(scene)
        name = file.stem
        if file.suffix == ".py":
            data = {"protocol": {"name": name, "source": file.name}}
        else:
            data = read_toml(file, "Scene")
            for table, verb in OTHERS.items():
                if table in data:
                    raise SceneError(
                        f"{file} is no scene, which has no [{table}]: it is for "
                        f"`{to_type(verb, file)}`."
                    )
            trust.check(data, file.parent)
    origins = {}
    if bench is None and scene is not None and "bench" not in data:
        bench = unless_named
    if bench is not None:
        data["bench"] = (
            {} if bench == SIMULATED else {"file": str(Path(bench).resolve())}
        )
        origins["bench.file"] = f"--bench {bench}"
    origins |= options.apply(data, overrides)
    return replace(resolve(data, file, origins), name=name)


def resolve(
    data: Mapping[str, Any], path: Path, origins: Mapping[str, str] | None = None
) -> Scene:
    """The scene that `data`, the contents of `path`, describes (see `load`)."""
    blame = _blame(str(path), origins or {})
    for name, table in data.items():
        if name not in TABLES:
            what = f"table [{name}]" if isinstance(table, dict) else f'key "{name}"'
            raise SceneError(
                f"{blame((name,))}: a scene has no {what}; "
                f"{choices(name, TABLES, 'Tables')}"
            )
        if not isinstance(table, dict):
            raise complaint((name,), "this must be a table, not a value.", blame)
    _refuse_impossible(data, blame)
    frozen = _moved(tuples(data))
    folder = path.parent
    spec = _bench(frozen.get("bench", {}), folder, blame)
    hand_set = dumped(spec).get("hand_set", {})
    given = with_preset(frozen.get("sensor", {}), hand_set)
    sensor = validated(Sensor, given, ("sensor",), blame)
    protocol, source = _protocol(frozen.get("protocol"), folder, blame)
    protocol = protocol.on_sensor(sensor.tau, abs(sensor.k_F))
    record = validated(Record, frozen.get("record", {}), ("record",), blame)
    if not record.signals:
        if "signals" in frozen.get("record", {}):
            raise complaint(("record", "signals"), "name at least one signal.", blame)
        signals = [
            name
            for name in protocol.signals
            if not protocol.as_wired
            or SIGNALS[name].source != "measured"
            or spec.measures(name)
        ]
        record = replace(record, signals=tuple(signals))
    detect = Detect.completed(frozen.get("detect", {}))
    return Scene(
        name=path.stem,
        path=path,
        bench=spec,
        sensor=sensor,
        protocol=protocol,
        protocol_source=source,
        record=record,
        detect=validated(Detect, detect, ("detect",), blame),
        simulated=validated(
            Simulated, frozen.get("simulated", {}), ("simulated",), blame
        ),
        conditions=validated(
            Conditions, frozen.get("conditions", {}), ("conditions",), blame
        ),
        coil=validated(CoilUse, frozen.get("coil", {}), ("coil",), blame),
    )


def load_bench(path: str | Path) -> BenchSpec:
    """The bench file `path`, or the built-in simulated bench for "sim".

    Raises:
        SceneError: it cannot be used as written.
    """
    table = {} if str(path) == SIMULATED else {"file": str(path)}
    return _bench(table, Path(), _blame(str(path), {}))


def _find(path: str | Path | None) -> Path:
    if path is None:
        return scene_path(DEMO)
    file = Path(path)
    if str(path) in scene_names() and not file.is_file():
        return scene_path(str(path))
    try:
        there = file.exists()
    except (OSError, ValueError) as reason:
        raise SceneError(
            f"Scene {str(path)[:80]!r} is no usable path: {reason}."
        ) from reason
    if not there:
        names = ", ".join(scene_names())
        hint = nearest(str(path), scene_names())
        raise SceneError(
            f"Scene {path} does not exist{'; ' + hint if hint else '.'} "
            f"Scenes that ship: {names}."
        )
    return file


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """The contents of a TOML file.

    Args:
        path: of the file.
        what: it is, for messages: "Scene", "Bench file".

    Raises:
        SceneError: it cannot be read, or is not TOML.
    """
    try:
        return tomllib.loads(read_text(path, what))
    except RecursionError as reason:
        raise SceneError(
            f"{path} is not usable TOML: it is nested too deeply."
        ) from reason
    except SceneError:
        raise
    except ValueError as reason:
        raise SceneError(f"{path} is not TOML: {reason}.") from reason


def _blame(name: str, origins: Mapping[str, str]) -> Blame:
    def origin(at: tuple[str, ...]) -> str:
        for depth in range(len(at), 0, -1):
            option = origins.get(".".join(at[:depth]))
            if option is not None:
                return option
        return name

    return origin


def _refuse_impossible(data: Any, blame: Blame, at: tuple[str, ...] = ()) -> None:
    for key, value in _items(data):
        here = (*at, key)
        if isinstance(value, float) and not math.isfinite(value):
            raise complaint(here, f"{value} is not finite; give a finite value.", blame)
        if isinstance(value, str) and "\0" in value:
            raise complaint(here, "a text may not hold a NUL character.", blame)
        _refuse_impossible(value, blame, here)


def _items(data: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(data, dict):
        yield from data.items()
    elif isinstance(data, list):
        yield from ((f"number {i + 1}", value) for i, value in enumerate(data))


def tuples(data: Any) -> Any:
    """What a file holds, its lists as tuples."""
    if isinstance(data, dict):
        return {key: tuples(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return tuple(tuples(value) for value in data)
    return data


def _protocol(
    table: dict[str, Any] | None, folder: Path, blame: Blame
) -> tuple[Protocol, Path | None]:
    if table is None or "name" not in table:
        raise SceneError(
            f"{blame(('protocol', 'name'))}: [protocol] name is missing; write for "
            'example name = "pulses".'
        )
    fields = dict(table)
    name, source = fields.pop("name"), fields.pop("source", None)
    for key, value in (("name", name), ("source", source)):
        needed = key == "name" or value is not None
        if needed and not isinstance(value, str):
            raise complaint(
                ("protocol", key), f"{written(value)}: a text is needed.", blame
            )
    try:
        if source is None:
            kind = protocol_class(name)
        else:
            kind = protocol_from_file(folder / source)
    except SceneError as reason:
        key = "name" if source is None else "source"
        raise complaint(("protocol", key), str(reason), blame) from reason
    if kind.name != name:
        raise complaint(
            ("protocol", "name"), f'{source} holds "{kind.name}", not "{name}".', blame
        )
    protocol = validated(kind, fields, ("protocol",), blame)
    try:
        return protocol.located(folder), source and (folder / source).resolve()
    except SceneError as reason:
        raise complaint(("protocol",), str(reason), blame) from reason


def _bench(table: dict[str, Any], folder: Path, blame: Blame) -> BenchSpec:
    """The bench file (or the built-in bench) with the scene's own keys over it."""
    inline = {key: v for key, v in _living(table).items() if key != "file"}
    file = table.get("file")
    if file is None:
        if inline.get("simulated") is False:
            raise complaint(
                ("bench", "simulated"),
                'a scene reaches instruments only by a bench file: write file = "..." '
                "or give --bench FILE.",
                blame,
            )
        text = resources.files("tactile_lab.scene") / "simulated_bench.toml"
        under, path = tomllib.loads(text.read_text(encoding="utf-8")), None
    else:
        if not isinstance(file, str):
            raise complaint(
                ("bench", "file"), f"{written(file)}: a text is needed.", blame
            )
        path = (folder / file).resolve()
        under = read_toml(path, "Bench file")
        if "file" in under:
            raise SceneError(f'{path}: a bench file has no key "file".')
        _refuse_impossible(under, _blame(str(path), {}))
        whole = under = _living(tuples(under))
        alone = validated(BenchSpec, whole, (), _blame(str(path), {}), None)
        _refuse_endless_heat(whole, alone, (), _blame(str(path), {}))
        if inline.get("simulated") is False and under.get("simulated") is True:
            raise complaint(
                ("bench", "simulated"), f"{file} is a simulated bench.", blame
            )
    merged = _merged(_of_the_same_rows(under, inline), _placed(inline, folder))
    if path is not None:
        folder, merged["file"] = path.parent, str(path)
    spec = validated(BenchSpec, merged, ("bench",), blame, folder)
    _refuse_endless_heat(inline, spec, ("bench",), blame)
    return spec


def _refuse_endless_heat(
    given: Mapping[str, Any], spec: BenchSpec, at: tuple[str, ...], blame: Blame
) -> None:
    """Refuse a continuous current, if it was given, that no current could exceed.

    A source may well be narrower than the coil, so one that was not given stands.
    """
    table = given.get("coil", {}).get("limits", {})
    if spec.coil is None or "continuous" not in table:
        return
    limits = spec.coil.limits
    if limits.continuous > limits.current:
        raise complaint(
            (*at, "coil", "limits", "continuous"),
            f"{show(limits.continuous, 'A')} is more than current, "
            f"{show(limits.current, 'A')}, so that heat would never count; give what "
            "may flow for ever.",
            blame,
        )


def _of_the_same_rows(under: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    """A bench's tables without the baud rate of a row that another one replaces."""
    kept = dict(tuples(under))
    for name, table in over.items():
        below = kept.get(name)
        if not (isinstance(table, dict) and isinstance(below, dict)):
            continue
        if table.get("dialect", below.get("dialect")) != below.get("dialect"):
            kept[name] = {key: v for key, v in below.items() if key != "baud"}
    return kept


def _moved(data: dict[str, Any]) -> dict[str, Any]:
    """`data` with what `[simulated]` once said of the bench where it is now."""
    bench = dict(data.get("bench", {}))
    if "file" in bench and "simulated" not in bench:
        return data  # what the file says of the bench counts
    world = dict(data.get("simulated", {}))
    old = {key: world.pop(key) for key in MOVED if key in world}
    fast, offset = world.pop("follower", None), world.pop("follower_offset", None)
    if offset is not None:
        world["deviation"] = {"offset": offset, **world.get("deviation", {})}
    # a real bench's run holds these keys too, and they meant nothing
    if bench.get("simulated", True):
        for key, value in old.items():
            table, name = MOVED[key]
            bench[table] = {name: value, **bench.get(table, {})}
        if fast is False:
            bench["followers"] = {"bandwidth": "0 Hz", **bench.get("followers", {})}
    return {**data, "simulated": world, "bench": bench}


def _living(bench: dict[str, Any]) -> dict[str, Any]:
    """A bench's tables without the keys that former versions wrote into each run."""
    return {
        name: {key: v for key, v in table.items() if key not in DEAD.get(name, ())}
        if isinstance(table, dict)
        else table
        for name, table in bench.items()
    }


def _placed(inline: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A scene's own bench keys; files they name lie beside the scene."""
    placed = dict(inline)
    for table, values in inline.items():
        if not isinstance(values, dict):
            continue
        if table == "voltage_source":  # a table of tables
            placed[table] = _placed(values, folder)
            continue
        files = {
            key: str((folder / name).resolve())
            for key, name in values.items()
            if (key in ("dialect", "driver") and is_file(name))
            or (key == "calibration" and isinstance(name, str))
            or (key == "library" and (folder / str(name)).exists())
        }
        placed[table] = {**values, **files}
    return placed


def _merged(under: Any, over: Any) -> Any:
    if not (isinstance(under, dict) and isinstance(over, dict)):
        return over
    return {
        **under,
        **{key: _merged(under.get(key), value) for key, value in over.items()},
    }
