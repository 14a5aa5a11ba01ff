"""What a connection file says of a machine's OPC UA server."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal
from urllib.parse import urlsplit

from pydantic import Field

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.schema import Strict

CLIENT_URI = "urn:discovery:compensator"


class ConnectionForm(Strict):
    """A connection file (TOML); paths are relative to it."""

    url: str = Field(description="opc.tcp://host:port/...; no user or password in it")
    application_uri: str = Field(CLIENT_URI, description="as in the own certificate")
    certificate: str = Field(description="own certificate (DER or PEM)")
    private_key: str = Field(description="own private key (PEM)")
    server_certificate: str = Field(description="certificate that the server must have (DER or PEM)")
    user: str | None = Field(None, description="user name at the server; default anonymous")
    password_file: str | None = Field(None, description="file whose first line is the password")
    password_env: str | None = Field(None, description="environment variable that holds the password")
    tick_s: float = Field(1.0, ge=0.05, le=60.0, description="time between ticks in s")
    stamps: Literal["sample", "change"] = Field(
        "sample",
        description="when the server renews SourceTimestamp: with each sample of the sensor, or when the "
        "value changes; with 'change' a value is as old as the clock of the server stands still",
    )
    inputs: dict[str, str] = Field({}, description="node id of each input of the model")
    offsets: dict[str, str] = Field(
        {}, description="node id of each offset, Double or Float, by name of the error"
    )
    errors: dict[str, str] = Field(
        {},
        description="node id of measured errors, where the machine measures itself; each stamp counts once",
    )
    errors_are: Literal["left", "uncompensated"] = Field(
        "left",
        description="measured errors are what the offsets leave, or what they would be without offsets",
    )
    status: str | None = Field(None, description="node id of the status word, UInt32")
    heartbeat: str | None = Field(None, description="node id of the heartbeat, UInt32")
    message: str | None = Field(None, description="node id of a String: the last event in words")
    enable: str | None = Field(None, description="node id of a Boolean: compensate or not")
    part_done: str | None = Field(None, description="node id of a Boolean: no cut is running")
    acknowledge: str | None = Field(
        None, description="node id of a Boolean: an operator has looked (each change to True counts once)"
    )

    def password(self, folder: Path) -> str | None:
        """The password, from a file or from the environment; None where no user is named.

        Raises:
            UserError: a user without a password, or a password that is not where it should be.
        """
        if self.user is None:
            return None
        if (self.password_file is None) == (self.password_env is None):
            raise UserError(
                f"the connection names user '{self.user}'; name its password with one of password_file and "
                "password_env"
            )
        if self.password_env is not None:
            found = os.environ.get(self.password_env)
            if found is None:
                raise UserError(f"the environment has no variable {self.password_env} with the password")
            return found
        path = folder / str(self.password_file)
        if not path.is_file():
            raise UserError(f"{path}: there is no such file; its first line should be the password")
        return (path.read_text(encoding="utf-8").splitlines() or [""])[0]

    def check(self, exported: Exported) -> None:
        """Whether it fits the model.

        Raises:
            UserError: an input without a node, an offset or error that the model does not give, a password in
            the address.
        """
        self.check_address()
        for name in (i.name for i in exported.inputs):
            if name not in self.inputs:
                raise UserError(
                    f"the connection names no node for input '{name}' of the model; add it under [inputs]"
                )
        known = {o.name for o in exported.outputs if o.role == "error"}
        for kind, names in (("an offset", self.offsets), ("a measured error", self.errors)):
            for name in names:
                if name not in known:
                    raise UserError(
                        f"the connection names {kind} '{name}', which the model does not give "
                        f"({', '.join(sorted(known))})"
                    )

    def check_address(self) -> None:
        """Raise UserError: a password in the address, where every log would show it."""
        parts = urlsplit(self.url)
        if parts.username is not None or parts.password is not None:
            raise UserError(
                "the url of the connection holds a user or a password; name them with user and "
                "password_file or "
                "password_env, so that no log shows them"
            )
