"""A session: a model at work on a source of readings, its memory on disk, a candidate in its shadow."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import TYPE_CHECKING

from discovery.export.document import Exported
from discovery.runtime.compensator import Compensator, Settings, Tick
from discovery.runtime.guards import Reading
from discovery.runtime.persistence import restore, save, succeed
from discovery.runtime.shadow import Rule, Shadow, begin_shadow, take_over
from discovery.runtime.store import open_store, refuse_candidate, replace_active

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

Say = Callable[[str], None]


class Session:
    """Runs a compensator and everything around it."""

    def __init__(
        self,
        exported: Exported,
        *,
        model: Path | None = None,
        folder: Path | None = None,
        trusted: Ed25519PublicKey | None = None,
        settings: Settings | None = None,
        rule: Rule | None = None,
        save_every_s: float = 600.0,
        beside: Executor | None = None,
        say: Say = lambda _: None,
    ) -> None:
        self.folder, self.say, self.save_every_s, self.beside = folder, say, save_every_s, beside
        self.settings = settings or Settings()
        self.shadow: Shadow | None = None
        self.resumed: float | None = None
        self.saved: float | None = None
        self.saving: Future[None] | None = None  # the last save, which may still be under way
        self.unsaved = False  # it has been said that saves fail
        if folder is not None and model is not None:
            models = open_store(folder, model, exported, trusted)
            exported = models.active
            if models.candidate is not None:
                self.shadow = begin_shadow(models.candidate, self.settings, rule)
                say(
                    f"revision {models.candidate.revision} runs in the shadow of revision {exported.revision}"
                )
        self.compensator = Compensator(exported, self.settings)
        if folder is not None:
            self.resumed = restore(self.compensator, folder)
            if self.resumed is None:
                succeed(self.compensator, folder)

    def tick(self, readings: Mapping[str, Reading], now: float, *, enabled: bool = True) -> Tick:
        """One tick with the newest readings, measured errors among them if there are any."""
        found = self.compensator.tick(readings, now, enabled=enabled)
        if self.shadow is not None:
            self.shadow.tick(self.compensator, readings, now)
            verdict = self.shadow.verdict(now)
            if verdict is not None:
                self._decide(*verdict)
        if self.folder is not None and (self.saved is None or now - self.saved >= self.save_every_s):
            self.save(now)
        return found

    def _decide(self, passed: bool, why: str) -> None:
        assert self.shadow is not None
        assert self.folder is not None
        if passed:
            self.compensator = take_over(self.compensator, self.shadow.compensator)
            replace_active(self.folder)
            self.saved = None
        else:
            refuse_candidate(self.folder)
        self.say(f"the new model {'takes over' if passed else 'is refused'}: {why}")
        self.shadow = None

    def save(self, now: float) -> None:
        """Write the state to disk, unless the save before is still under way."""
        if self.folder is None or self.compensator.origin is None:
            return
        if self.saving is not None and not self.saving.done():
            return
        self._hear()
        self.saving = save(self.compensator, self.folder, self.beside)
        self.saved = now
        if self.beside is None:
            self._hear()

    def close(self, now: float) -> None:
        """Write the state a last time, and wait until it stands on the disk."""
        self._hear()
        self.save(now)
        self._hear()

    def _hear(self) -> None:
        """What became of the last save; the first of several that fail is told, the compensation goes on."""
        if self.saving is None:
            return
        error, self.saving = self.saving.exception(), None
        if error is not None and not self.unsaved:
            self.say(
                f"{self.folder}: the state cannot be saved ({error}); the compensation goes on, but a "
                "restart would begin from an older state: make room or give it another folder with --state"
            )
        self.unsaved = error is not None
