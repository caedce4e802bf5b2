"""USBTMC bulk headers as bytes: USB Test and Measurement Class 1.0, s. 3.2 and 3.3."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from tactile_lab.errors import BadReplyError

HEADER = 12
DEV_DEP_MSG_OUT = 1
DEV_DEP_MSG_IN = 2
_EOM = 0x01
_LAYOUT = struct.Struct("<BBBxIB3x")


@dataclass(frozen=True)
class FrameHeader:
    """A bulk header.

    Attributes:
        message: MsgID.
        tag: bTag, 1 to 255.
        size: message bytes in this transfer (or wanted, in a request).
        end: end of message (EOM).
    """

    message: int
    tag: int
    size: int
    end: bool

    def pack(self) -> bytes:
        """The 12 bytes on the wire."""
        return _LAYOUT.pack(
            self.message, self.tag, ~self.tag & 0xFF, self.size, _EOM * self.end
        )

    @classmethod
    def unpack(cls, raw: bytes) -> FrameHeader:
        """The header at the start of `raw`.

        Raises:
            BadReplyError: too short, or bTag and its complement disagree.
        """
        if len(raw) < HEADER:
            raise BadReplyError(
                f"A USBTMC header has {HEADER} bytes; only {len(raw)} came: "
                f"{raw.hex(' ')}."
            )
        message, tag, inverse, size, attributes = _LAYOUT.unpack_from(raw)
        if inverse != ~tag & 0xFF or tag == 0:
            raise BadReplyError(
                f"A USBTMC header is garbled: bTag {tag:#04x} with complement "
                f"{inverse:#04x}, in {raw[:HEADER].hex(' ')}."
            )
        return cls(message, tag, size, bool(attributes & _EOM))


def message_out(tag: int, payload: bytes) -> bytes:
    """DEV_DEP_MSG_OUT with `payload`, padded with zeros to a multiple of 4."""
    pad = -len(payload) % 4
    header = FrameHeader(DEV_DEP_MSG_OUT, tag, len(payload), True)
    return header.pack() + payload + bytes(pad)


def request_in(tag: int, size: int) -> bytes:
    """REQUEST_DEV_DEP_MSG_IN for at most `size` message bytes."""
    return FrameHeader(DEV_DEP_MSG_IN, tag, size, False).pack()


def next_tag(tag: int) -> int:
    """The bTag after `tag`: 1 to 255, then 1 again."""
    return tag % 255 + 1


def block_payload(message: bytes) -> bytes:
    """The data of an IEEE 488.2 definite-length block (``#42000...``).

    Raises:
        BadReplyError: not such a block, or shorter than it says.
    """
    start, size = block_size(message)
    payload = message[start : start + size]
    if len(payload) < size:
        raise BadReplyError(
            f"A data block of {size} bytes was announced, {len(payload)} came."
        )
    return payload


def block_size(message: bytes) -> tuple[int, int]:
    """Where a definite-length block's data start, and their length.

    Raises:
        BadReplyError: not such a block.
    """
    digits = message[1:2]
    count = int(digits) if digits.isdigit() else 0
    length = message[2 : 2 + count]
    if (
        message[:1] != b"#"
        or count == 0
        or not (len(length) == count and length.isdigit())
    ):
        raise BadReplyError(
            f"{message[:16]!r} does not begin a data block (#<n><length>)."
        )
    return 2 + count, int(length)
