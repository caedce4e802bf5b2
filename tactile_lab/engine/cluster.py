"""A Dask cluster, whose workers must run the same code."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from tactile_lab.errors import LinkLostError, NotFoundError, SceneError
from tactile_lab.plugins import registered

GREETING = 5.0
"""For which a scheduler is waited for, s."""
ANSWER = 60.0
"""For which a Dask worker is waited for to tell its version, s."""
SCHEMES = ("tcp://", "inproc://", "tls://", "ucx://", "ws://", "wss://")
"""With which an address of a scheduler may begin."""
DIGEST = 16
"""Bytes of a digest of code."""
REGISTERED = (
    "tactile_lab.drivers",
    "tactile_lab.far_ends",
    "tactile_lab.benches",
    "tactile_lab.protocols",
)
"""Groups of entry points whose packages a result may depend on."""


@contextmanager
def cluster(address: str) -> Iterator[Any]:
    """A client of a Dask scheduler whose workers compute what this program does.

    Raises:
        NotFoundError: the scheduler does not answer, or Dask is not installed.
        SceneError: a worker runs other code.
        LinkLostError: a worker does not answer.
    """
    try:
        import distributed
    except ImportError as reason:
        raise NotFoundError(
            "--scheduler needs Dask. In the checkout: pip install -e '.[cluster]'."
        ) from reason
    if not address.startswith(SCHEMES):
        raise NotFoundError(
            f"--scheduler {address}: write its address, such as tcp://HOST:8786."
        )
    try:
        urlsplit(address).port  # noqa: B018  Dask leaves a client behind otherwise
        with ThreadPoolExecutor(1) as beside:  # a notebook has a loop of its own
            beside.submit(lambda: asyncio.run(_greet(address))).result()
        open_client: Any = distributed.Client  # untyped
        client = open_client(address, timeout=GREETING, set_as_default=False)
    except (OSError, ValueError) as reason:  # a timeout, too
        why = str(reason).rstrip(".") or f"it was silent for {GREETING:g} s"
        raise NotFoundError(
            f"The scheduler {address} does not answer: {why}. Is `dask scheduler` "
            "running there, and the address of the form tcp://HOST:8786?"
        ) from reason
    try:
        _check_versions(client, address)
        yield client
    finally:
        client.close()


async def _greet(address: str) -> None:
    """Shake hands: a client waits without end for a port that takes it and is silent.

    Raises:
        OSError: nothing answers.
    """
    from distributed.comm.core import connect

    greeted: Any = connect  # untyped
    comm = await asyncio.wait_for(greeted(address, timeout=GREETING), GREETING + 1)
    await comm.close()


def _question() -> Callable[[], dict[str, str] | None]:
    """What a worker is asked; it is sent whole, to be understood without this program.

    It answers None where it lacks this program, or has one of before this question.
    """

    def ask() -> dict[str, str] | None:
        try:
            from tactile_lab.engine.cluster import code_digests
        except ImportError:
            return None
        return code_digests()

    return ask


def _check_versions(client: Any, address: str) -> None:
    """Refuse workers that would compute something else."""
    if not client.nthreads():
        raise NotFoundError(f"The scheduler {address} has no workers; start some.")
    try:
        asked = {
            where: client.submit(_question(), workers=[where], pure=False)
            for where in client.nthreads()
        }
        theirs = {where: one.result(timeout=ANSWER) for where, one in asked.items()}
    except OSError as reason:  # a timeout, too
        raise LinkLostError(
            f"The scheduler {address} or one of its workers went silent: "
            f"{str(reason).rstrip('.')}. Nothing is lost; start again."
        ) from reason
    ours = code_digests()
    for where, found in theirs.items():
        if found is None:
            raise SceneError(
                f"The worker {where} of {address} lacks this program, or has a version "
                "of before this one; install the same on each."
            )
        missing = [package for package in ours if package not in found]
        other = [p for p, digest in found.items() if ours.get(p, digest) != digest]
        if missing or other:
            what = (
                f"lacks {', '.join(missing)}"
                if missing
                else f"has another version of {', '.join(other)}"
            )
            raise SceneError(
                f"The worker {where} of {address} {what}; install the same version of "
                "this program on each."
            )


@cache
def code_digests() -> dict[str, str]:
    """Of the source of each package that a result may depend on, by package."""
    from importlib.util import find_spec

    modules = {
        entry.module for group in REGISTERED for entry in registered(group).values()
    }
    digests = {}
    for package in sorted({name.partition(".")[0] for name in (__name__, *modules)}):
        spec = find_spec(package)
        if spec is None:
            continue
        found = hashlib.blake2b(digest_size=DIGEST)
        for place in spec.submodule_search_locations or ():
            for path in sorted(Path(place).rglob("*.py")):
                found.update(str(path.relative_to(place)).encode())
                found.update(path.read_bytes())
        digests[package] = found.hexdigest()
    return digests
