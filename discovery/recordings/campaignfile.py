"""The form of `campaign.toml`."""

import re
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from discovery.naming import is_taken, is_word
from discovery.recordings.columns import TIME
from discovery.recordings.roles import CORRECTION, Between, Role, is_input
from discovery.schema import Strict

_ANOTHER = 'choose another one, and say column = "{}" where the header of the files has to stay'


def _channel_name(name: str) -> str:
    if is_taken(name):
        raise ValueError(f"this word has a meaning of its own in expressions; {_ANOTHER.format(name)}")
    if not is_word(name):
        raise ValueError(
            "a channel's name is a word of letters, digits and _ (expressions use it); "
            + _ANOTHER.format(name)
        )
    return name


def _recording_name(name: str) -> str:
    if not re.fullmatch(r"\w[\w.+-]*", name):
        raise ValueError("a recording's name becomes a file name: use letters, digits, _ . + -")
    return name


def _column_name(name: str) -> str:
    if name == TIME:
        raise ValueError("the column 'time' is the clock of a recording, not a channel; name another column")
    return name


class ChannelForm(Strict):
    """One line of [channels]."""

    role: Role
    unit: str = Field(description="a unit that pint knows")
    noise: float | None = Field(None, gt=0, description="standard deviation of a reading, in the unit")
    spread: float | None = Field(
        None,
        gt=0,
        description="in each recording the values are off by one unknown constant with this standard "
        "deviation, in the unit (a difference); a fit finds it. An error then counts from its first reading",
    )
    between: Between | None = Field(None, description="what the value does between stamps")
    column: Annotated[str, AfterValidator(_column_name)] | None = Field(
        None, description="the header in the files, when it is not the channel's name"
    )
    corrects: str | None = Field(
        None,
        description="of an applied correction: the error to whose readings it is added; "
        "default: the one whose name is part of its own",
    )
    sign: Literal[1, -1] = Field(
        1,
        description="of an applied correction: 1 for what was taken off the error, "
        "-1 for what was added to the position, as `discovery compensate` gives it out",
    )

    guessed: str | None = Field(
        None,
        description="what `discovery new` was not sure of; delete it once you have looked",
    )

    @model_validator(mode="after")
    def _corrections_alone_correct(self) -> Self:
        given = [name for name in ("corrects", "sign") if name in self.model_fields_set]
        if given and self.role != CORRECTION:
            raise ValueError(
                f"{' and '.join(given)} belong to the role '{CORRECTION}' alone; "
                "take them away or change the role"
            )
        return self

    @model_validator(mode="after")
    def _inputs_and_errors_spread(self) -> Self:
        if self.spread is not None and not (is_input(self.role) or self.role == "error"):
            raise ValueError(
                f"spread belongs to inputs of models and to errors, not to the role '{self.role}'; "
                "take it away (the noise of readings is noise)"
            )
        return self


class RecordingForm(Strict):
    """One line of [recordings]."""

    file: str = Field(
        min_length=1, description="CSV (plain or gzip) or Parquet, relative to the campaign file"
    )
    set: dict[str, float] = Field(default={}, description="channels that are constant in this recording")
    note: str = ""


class CampaignForm(Strict):
    """The whole file."""

    name: str
    simulated: bool = Field(False, description="true: the recordings come from a simulation; reports say so")
    guessed: str | None = Field(None, description="the same, of the clock of the files")
    channels: dict[Annotated[str, AfterValidator(_channel_name)], ChannelForm] = Field(min_length=1)
    recordings: dict[Annotated[str, AfterValidator(_recording_name)], RecordingForm] = Field(min_length=1)


def campaign_path(path: Path) -> Path:
    """The campaign file itself when its folder is named."""
    try:
        return path / "campaign.toml" if path.is_dir() else path
    except OSError:  # a name too long for any file: reading it says so
        return path
