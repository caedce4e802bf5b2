"""Names of one serial port: the bench file's, and the adapter's own, which stays."""

from __future__ import annotations

import json
import os
from contextlib import suppress

from tactile_lab.errors import RecordingError
from tactile_lab.instruments.port import kept_of_port, lasting_name
from tactile_lab.whole_file import write_text


class PortNames:
    """By which names an instrument's port may be found.

    What was learned when it was opened is kept for the programs that come next.

    Args:
        named: the port, as the bench file writes it.

    Attributes:
        identity: what answered there when it was opened last; None if that is not kept.
    """

    def __init__(self, named: str) -> None:
        self.named = named
        self.identity: str | None = None
        self._lasting: str | None = None
        self._file = kept_of_port("ports", named)
        with suppress(OSError, ValueError, TypeError, KeyError):  # then nothing is kept
            kept = json.loads(self._file.read_bytes())
            self._lasting, self.identity = str(kept["lasting"]), str(kept["identity"])

    def learn(self, port: str, identity: str) -> None:
        """At `port` answers the instrument, which calls itself `identity`."""
        lasting = lasting_name(port)
        if lasting is None or (lasting, identity) == (self._lasting, self.identity):
            return
        self._lasting, self.identity = lasting, identity
        # unkept, it costs only that the next program does not find it elsewhere
        with suppress(OSError, RecordingError):
            text = json.dumps({"lasting": lasting, "identity": identity})
            write_text(self._file, text)

    @property
    def elsewhere(self) -> str | None:
        """The adapter's own name, where it is plugged in and is not where it was."""
        if self._lasting is None or not os.path.exists(self._lasting):
            return None
        same = os.path.realpath(self._lasting) == os.path.realpath(self.named)
        return None if same else self._lasting

    def every(self, port: str) -> tuple[str, ...]:
        """`port`, and the adapter's own name where that is another."""
        own = self._lasting
        return (port,) if own is None or own == port else (port, own)
