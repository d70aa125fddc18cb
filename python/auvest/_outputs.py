"""Results appear whole or not at all: every folder of results is made under another name first.

:class:`NewFolder` makes ``NAME.unfinished`` beside the folder ``NAME``, in which everything is
written, and a manifest that says who made it. :meth:`NewFolder.publish` sets the folder that was
there aside as ``NAME.old``, gives the new one its name, and removes the old one. What is stopped
before, by whatever means, leaves the old results as they were and a folder whose name says that it
is unfinished; the next run removes it. A folder is only replaced if its manifest says that the same
command made it and all that is in it; nothing that auvest has not written is ever removed, and no
link is followed.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import secrets
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from auvest._interrupts import HeldInterrupts

try:
    import fcntl
except ImportError:  # Windows, where an open folder cannot be removed
    fcntl = None  # type: ignore[assignment]

if TYPE_CHECKING:
    from typing_extensions import Self

#: Says who made a folder of results, and of which files.
MANIFEST = ".auvest.json"
UNFINISHED, OLD = ".unfinished", ".old"


class OutputError(ValueError):
    """A folder is not where results may go; the message says why."""


class NewFolder:
    """A folder of results that takes the place of the one before as a whole.

    Parameters
    ----------
    path : Path
        Where the results will be. The folders above are made.
    command : str
        The words after ``auvest``: its own earlier results are replaced.
    force : bool
        Replace the results of another command too, and set aside for good, as ``NAME.old``, a
        folder that auvest has not made.
    precious : bool
        What was written cannot be made again: it stays where it is if it is not published, and no
        other run removes it without ``force``.

    Attributes
    ----------
    path : Path
        As given.
    part : Path
        Where to write until it is published.
    kept : Path or None
        Where what auvest had not made was set aside.
    left : Path or None
        Where what is precious and was not published is.

    Raises
    ------
    OutputError
        If something is there that must not be replaced, or another process is writing it.
    OSError
        If it cannot be written.
    """

    def __init__(
        self, path: Path, command: str, *, force: bool = False, precious: bool = False
    ) -> None:
        self.path = path
        self.kept: Path | None = None
        self.left: Path | None = None
        self._command = command
        self._force = force
        self._precious = precious
        self._lock = -1
        absolute = Path.cwd() / path
        if absolute.name in ("", "..") or path.name == "":
            absolute = absolute.resolve()  # "." and ".." have no name of their own
        self._target = absolute
        self.part = absolute.with_name(absolute.name + UNFINISHED)
        self._old = absolute.with_name(absolute.name + OLD)
        if Path.cwd().is_relative_to(absolute):
            raise OutputError(f"{path} is the working folder or above it: name a folder of its own")
        above = [absolute.parent, *absolute.parent.parents]
        self._made = [folder for folder in above if not folder.exists()]
        absolute.parent.mkdir(parents=True, exist_ok=True)
        self._take_back()
        self._require_ours()
        self._make_part(precious)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.discard()

    def publish(self, *, interrupted: bool = False) -> None:
        """Give the new folder its name.

        Parameters
        ----------
        interrupted : bool
            Whether it holds only what was done until Ctrl-C; the manifest says so.

        Raises
        ------
        OutputError
            If something has come in the meantime that must not be replaced; what was written stays
            in ``part``.
        OSError
            If it cannot be done; ``part`` stays for :meth:`discard`.
        """
        from concurrent.futures import ThreadPoolExecutor  # here, because it is slow to import

        _write_manifest(self.part, self._command, "interrupted" if interrupted else "whole")
        # Together, because the disk then does them at once.
        found = [*self.part.rglob("*"), self.part]
        with ThreadPoolExecutor(min(16, len(found))) as pool:
            list(pool.map(_to_disk, found))
        with HeldInterrupts() as held, held:
            try:
                ours = self._require_ours()
            except OutputError:
                self._unlock()
                raise
            if _exists(self._target):
                self._set_aside(ours)
            self.part.rename(self._target)
            self._unlock()
            _to_disk(self._target.parent)
            if self.kept is None and _exists(self._old) and _is_ours(self._old):
                _remove(self._old)

    def discard(self) -> None:
        """Remove what was written, unless it is published or precious; safe to call at any time."""
        if self._lock >= 0:
            if self._precious and _names(self.part) - {MANIFEST}:
                self.left = self.part
                self._unlock()
                return
            with contextlib.suppress(OSError):
                _remove(self.part)
                for folder in self._made:
                    folder.rmdir()  # unless somebody has put something there
            self._unlock()

    def _take_back(self) -> None:
        """Mend what was stopped between the two renames: put the old results back."""
        if not _exists(self._target) and _is_whole(self._old):
            self._old.rename(self._target)

    def _require_ours(self) -> bool:
        """Refuse to replace what is there, if it must not be; say if all of it is auvest's."""
        try:
            mode = os.lstat(self._target).st_mode
        except FileNotFoundError:
            return True
        if stat.S_ISLNK(mode):
            raise OutputError(f"{self.path} is a link: name the folder itself")
        if not stat.S_ISDIR(mode):
            raise NotADirectoryError(errno.ENOTDIR, "is not a folder")
        there = sorted(_names(self._target))
        if not there:
            return True
        ours = _is_ours(self._target)
        manifest = _manifest(self._target)
        if self._force or (ours and manifest.get("command") == self._command):
            return ours
        if ours:
            raise OutputError(
                f"{self.path} holds the results of 'auvest {manifest.get('command')}': "
                "choose another folder, or replace them with --force"
            )
        foreign = next(name for name in there if name not in _listed(manifest))
        raise OutputError(
            f"{self.path} holds what auvest has not written ({foreign!r}): choose another folder, "
            "or set it aside with --force"
        )

    def _make_part(self, precious: bool) -> None:
        try:
            self.part.mkdir()
        except FileExistsError:
            self._remove_stopped(precious and not self._force)
            self.part.mkdir()
        self._lock = _locked(self.part)
        _write_manifest(self.part, self._command, "unfinished")

    def _remove_stopped(self, precious: bool) -> None:
        """Remove what was stopped before it was finished, if it is ours and nobody writes it."""
        shown = self.path.with_name(self.part.name)
        there = _names(self.part) if _is_folder(self.part) else {""}
        unsigned = all(name.startswith(MANIFEST) for name in there)  # stopped at the very beginning
        if not (unsigned or "command" in _manifest(self.part)):
            raise OutputError(f"{shown} is there, and auvest has not made it: move it away")
        if precious and not unsigned:
            raise OutputError(
                f"{shown} holds what was recorded when auvest was stopped: move it away, or "
                "remove it with --force"
            )
        lock = _locked(self.part)
        try:
            if lock < 0:
                raise OutputError(f"{shown} is being written by another auvest")
            _remove(self.part)
        finally:
            if lock >= 0:
                os.close(lock)

    def _set_aside(self, ours: bool) -> None:
        if not _names(self._target):
            self._target.rmdir()  # renaming to an empty folder is not for every system
            return
        aside = self._old
        if _exists(aside) and _is_ours(aside):
            _remove(aside)
        number = 1
        while _exists(aside):
            number += 1
            aside = self._old.with_name(f"{self._old.name}-{number}")
        self._target.rename(aside)
        self._old = aside
        if not ours:
            self.kept = aside

    def _unlock(self) -> None:
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1


def shared_folder(path: Path, command: str) -> None:
    """Make a folder that any number of runs of a command fill together, or take it as it is.

    Parameters
    ----------
    path : Path
        The folder.
    command : str
        The words after ``auvest``.

    Raises
    ------
    OutputError
        If it holds what this command has not begun.
    OSError
        If it cannot be made.
    """
    path.mkdir(parents=True, exist_ok=True)
    there = {name for name in _names(path) if not name.endswith(UNFINISHED)}
    maker = _manifest(path).get("command")
    if maker == command:
        return
    if there - {MANIFEST}:
        whose = "what auvest has not written" if maker is None else f"results of 'auvest {maker}'"
        raise OutputError(f"{path} holds {whose}: choose another folder")
    _write_manifest(path, command, "shared")


@contextlib.contextmanager
def new_file(
    path: Path, mode: str = "wb", *, hidden: bool = False, **options: Any
) -> Iterator[IO[Any]]:
    """Write a file that takes the place of the one before as a whole.

    It is made beside it under a name that nobody else has, which begins with a dot if it is
    ``hidden``, so that no link is followed. A name is given at the end; only a power cut can leave
    the new one empty.
    """
    dot = "." if hidden else ""
    new = path.with_name(f"{dot}{path.name}.{secrets.token_hex(4)}{UNFINISHED}")
    try:
        with new.open(mode.replace("w", "x"), **options) as file:  # x: it must not exist
            yield file
        new.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            new.unlink()
        raise


def is_plain_file(path: Path) -> bool:
    """Whether it is a file: no folder, pipe or device. Links to files are."""
    try:
        return stat.S_ISREG(path.stat().st_mode)
    except (OSError, ValueError):
        return False


def _manifest(folder: Path) -> dict[str, Any]:
    path = folder / MANIFEST
    try:
        if not stat.S_ISREG(os.lstat(path).st_mode):
            return {}
        read = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return read if isinstance(read, dict) else {}


def _listed(manifest: dict[str, Any]) -> set[str]:
    files = manifest.get("files")
    return {MANIFEST, *map(str, files)} if isinstance(files, list) else set()


def _is_ours(folder: Path) -> bool:
    """Whether auvest has written all that is in a folder."""
    return _is_folder(folder) and _names(folder) <= _listed(_manifest(folder))


def _is_whole(folder: Path) -> bool:
    return _is_folder(folder) and _names(folder) == _listed(_manifest(folder))


def _is_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()


def _write_manifest(folder: Path, command: str, state: str) -> None:
    files = sorted(_names(folder) - {MANIFEST})
    document = {"command": command, "version": _version(), "state": state, "files": files}
    with new_file(folder / MANIFEST, "w", encoding="utf-8") as file:
        file.write(json.dumps(document, indent=1) + "\n")


def _version() -> str:
    from importlib import metadata  # here, because it takes long to import

    try:
        return metadata.version("auvest")
    except metadata.PackageNotFoundError:
        return "unknown"


def _names(folder: Path) -> set[str]:
    return {entry.name for entry in folder.iterdir()}


def _exists(path: Path) -> bool:
    return os.path.lexists(path)


def _remove(folder: Path) -> None:
    """Remove a folder of ours, its manifest last, so that it says what it is until the end."""
    for name in _names(folder):
        entry = folder / name
        if name == MANIFEST:
            continue
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        else:
            entry.unlink()
    (folder / MANIFEST).unlink(missing_ok=True)
    folder.rmdir()


def _locked(folder: Path) -> int:
    """Lock a folder as long as this process lives; -1 if another has."""
    if fcntl is None:
        return os.open(os.devnull, os.O_RDONLY)
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(handle)
        return -1
    except OSError:
        pass  # a file system without locks
    return handle


def _to_disk(path: Path) -> None:
    """Have what was written on the disk before it gets its name: a power cut is a stop too."""
    if fcntl is None or path.is_symlink():
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError:
        pass  # a file system that cannot
    finally:
        os.close(handle)
