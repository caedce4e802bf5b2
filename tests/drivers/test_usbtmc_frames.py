"""USBTMC headers and data blocks as bytes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.usbtmc.frames import (
    FrameHeader,
    block_payload,
    message_out,
    next_tag,
    request_in,
)
from tactile_lab.errors import BadReplyError


def test_the_example_of_the_standard() -> None:
    # USBTMC 1.0, s. 3.2.1.1: bTag 0x01, 19 bytes with EOM
    frame = message_out(1, b"*IDN?\n")
    assert frame == bytes.fromhex("0101fe0006000000 01000000") + b"*IDN?\n\0\0"
    assert request_in(2, 1024) == bytes.fromhex("0202fd00 00040000 00000000")


@given(
    st.integers(0, 255), st.integers(1, 255), st.integers(0, 2**32 - 1), st.booleans()
)
def test_headers_survive_the_wire(message: int, tag: int, size: int, end: bool) -> None:
    header = FrameHeader(message, tag, size, end)
    assert len(header.pack()) == 12
    assert FrameHeader.unpack(header.pack() + b"more") == header


@given(st.binary(min_size=1, max_size=50), st.integers(1, 255))
def test_messages_are_padded_to_four(payload: bytes, tag: int) -> None:
    frame = message_out(tag, payload)
    assert len(frame) % 4 == 0
    assert FrameHeader.unpack(frame).size == len(payload)
    assert frame[12 : 12 + len(payload)] == payload


@given(st.binary(max_size=40))
def test_garbage_is_refused_or_a_header(raw: bytes) -> None:
    try:
        header = FrameHeader.unpack(raw)
    except BadReplyError:
        return
    assert header.pack()[:3] == raw[:3]


def test_tags_run_from_1_to_255() -> None:
    tags, tag = [], 0
    for _ in range(256):
        tag = next_tag(tag)
        tags.append(tag)
    assert tags == [*range(1, 256), 1]


@given(st.binary(max_size=300))
def test_blocks(payload: bytes) -> None:
    assert block_payload(b"#9%09d" % len(payload) + payload + b"\n") == payload
    size = str(len(payload)).encode()
    assert block_payload(b"#%d%s" % (len(size), size) + payload) == payload


@pytest.mark.parametrize(
    "bad", [b"", b"#", b"123", b"#0abc", b"#x12", b"#3 12ab", b"#212a"]
)
def test_bad_blocks(bad: bytes) -> None:
    with pytest.raises(BadReplyError):
        block_payload(bad)
