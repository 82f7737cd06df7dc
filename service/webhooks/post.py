"""Sends one message of a webhook to an address that was checked. Of the answer, only the status is read."""

from __future__ import annotations

import asyncio
import re
import ssl
from collections.abc import Mapping, Sequence

from service.webhooks.receiver import Receiver

ANSWER_BYTES = 16_384
"""The largest size of the headers of an answer."""
_STATUS = re.compile(rb"HTTP/1\.[01] ([1-5][0-9]{2})(?: [^\r\n]*)?\r\n")


class NoAnswer(Exception):
    """The receiver did not answer as HTTP asks for."""


def post(
    receiver: Receiver, addresses: Sequence[str], headers: Mapping[str, str], body: bytes, *, timeout_s: float
) -> int:
    """Send a message and return the status of the answer. Redirects are not followed.

    Parameters
    ----------
    addresses
        The addresses of the receiver, tried in order until one accepts a connection. Its name is not resolved again.
    timeout_s
        The longest time in all, from the connection to the last header of the answer, s.

    Raises
    ------
    NoAnswer
        If no address accepts a connection, the certificate is not the one of the host, or no answer comes in time.
    """
    try:
        return asyncio.run(asyncio.wait_for(_post(receiver, addresses, headers, body), timeout_s))
    except TimeoutError as error:
        raise NoAnswer(f"there was no answer within {timeout_s:g} s") from error
    except ssl.SSLCertVerificationError as error:
        raise NoAnswer(f"the certificate is not valid for {receiver.host}: {error.verify_message}") from error
    except (OSError, EOFError, asyncio.LimitOverrunError) as error:
        raise NoAnswer(f"the connection failed: {type(error).__name__}") from error


async def _post(receiver: Receiver, addresses: Sequence[str], headers: Mapping[str, str], body: bytes) -> int:
    reader, writer = await _connect(receiver, addresses)
    try:
        fields = {
            "Host": receiver.place,
            "Connection": "close",
            "User-Agent": "Lippmann",
            "Content-Type": "application/json",
            "Content-Length": str(len(body)),
            **headers,
        }
        lines = [f"POST {receiver.target} HTTP/1.1", *(f"{name}: {value}" for name, value in fields.items()), "", ""]
        writer.write("\r\n".join(lines).encode("ascii") + body)
        await writer.drain()
        status = 100
        while 100 <= status < 200:  # An interim answer comes before the answer.
            match = _STATUS.match(await reader.readuntil(b"\r\n\r\n"))
            if match is None:
                raise NoAnswer("the answer was not HTTP")
            status = int(match[1])
        return status
    finally:
        writer.transport.abort()


async def _connect(receiver: Receiver, addresses: Sequence[str]) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    context = ssl.create_default_context() if receiver.is_tls else None
    name = receiver.host if receiver.is_tls else None
    failure: OSError = OSError("the host has no address")
    for address in addresses:
        try:
            return await asyncio.open_connection(
                address, receiver.port, ssl=context, server_hostname=name, limit=ANSWER_BYTES
            )
        except ssl.SSLError:
            raise
        except OSError as error:
            failure = error
    raise failure
