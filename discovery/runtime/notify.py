"""A word to the service manager (systemd's sd_notify): ready, still alive, what it does."""

from __future__ import annotations

import os
import socket


def notify(**words: str | int) -> None:
    """Send words as `NAME=value` to the socket that the service manager named; nothing where it named none.

    `notify(READY=1)`, `notify(WATCHDOG=1, STATUS="ACTIVE")`, `notify(STOPPING=1)`.
    """
    address = os.environ.get("NOTIFY_SOCKET")
    if not address:
        return
    text = "\n".join(f"{name}={value}" for name, value in words.items())
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as one:
            one.connect("\0" + address[1:] if address.startswith("@") else address)
            one.sendall(text.encode())
    except OSError:  # a service manager that does not listen stops no compensation
        return
