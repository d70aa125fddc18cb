"""Results appear whole or not at all: the folder that takes another's place."""

import json
import os
import signal
from pathlib import Path

import pytest

from auvest._interrupts import HeldInterrupts
from auvest._outputs import MANIFEST, NewFolder, OutputError, new_file


def publish(path: Path, command: str = "replay", text: str = "new", **options: bool) -> NewFolder:
    with NewFolder(path, command, **options) as new:
        (new.part / "a.csv").write_text(text)
        new.publish()
    return new


def files(path: Path) -> dict[str, str]:
    """Give what a tree holds, without the manifests."""
    return {
        str(found.relative_to(path)): found.read_text()
        for found in sorted(path.rglob("*"))
        if found.is_file() and found.name != MANIFEST
    }


def test_nothing_is_there_before_all_is(tmp_path: Path) -> None:
    with NewFolder(tmp_path / "below" / "out", "replay") as new:
        (new.part / "a.csv").write_text("1")
        assert [path.name for path in (tmp_path / "below").iterdir()] == ["out.unfinished"]
        new.publish()
    assert files(tmp_path) == {"below/out/a.csv": "1"}
    manifest = json.loads((tmp_path / "below" / "out" / MANIFEST).read_text())
    assert (manifest["command"], manifest["state"]) == ("replay", "whole")
    assert manifest["files"] == ["a.csv"]


def test_what_is_not_published_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="full"), NewFolder(tmp_path / "a" / "b" / "out", "replay"):
        raise OSError("the disk is full")
    assert list(tmp_path.iterdir()) == []  # not even the folders above


def test_the_same_command_replaces_its_own_results(tmp_path: Path) -> None:
    with NewFolder(tmp_path / "out", "replay") as new:
        (new.part / "a.csv").write_text("old")
        (new.part / "only_then.csv").write_text("old")
        new.publish()
    publish(tmp_path / "out")
    assert files(tmp_path) == {"out/a.csv": "new"}


def test_results_of_another_command_are_replaced_by_force_only(tmp_path: Path) -> None:
    publish(tmp_path / "out", "simulate aukf", "old")
    with pytest.raises(OutputError, match=r"out holds the results of 'auvest simulate aukf'"):
        publish(tmp_path / "out")
    assert files(tmp_path) == {"out/a.csv": "old"}
    publish(tmp_path / "out", force=True)
    assert files(tmp_path) == {"out/a.csv": "new"}


def test_what_auvest_has_not_written_is_never_removed(tmp_path: Path) -> None:
    """By force it is set aside, again and again, each under a name of its own."""
    for text in ("first", "second"):
        publish(tmp_path / "out", force=True)
        (tmp_path / "out" / "notes.txt").write_text(text)
        with pytest.raises(OutputError, match=r"not written \('notes.txt'\)"):
            publish(tmp_path / "out")
    new = publish(tmp_path / "out", force=True)
    assert new.kept == tmp_path / "out.old-2"
    assert files(tmp_path) == {
        "out/a.csv": "new",
        "out.old/a.csv": "new",
        "out.old/notes.txt": "first",
        "out.old-2/a.csv": "new",
        "out.old-2/notes.txt": "second",
    }


def test_what_comes_while_it_is_written_is_kept_too(tmp_path: Path) -> None:
    with NewFolder(tmp_path / "out", "replay") as new:
        (new.part / "a.csv").write_text("new")
        (tmp_path / "out").mkdir()
        (tmp_path / "out" / "notes.txt").write_text("mine")
        with pytest.raises(OutputError, match=r"notes\.txt"):
            new.publish()
    assert files(tmp_path) == {"out/notes.txt": "mine", "out.unfinished/a.csv": "new"}


def test_no_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "victim").mkdir()
    (tmp_path / "victim" / "a.csv").write_text("precious")
    for name in ("out", "out.unfinished", "out.old"):
        link = tmp_path / name
        link.symlink_to(tmp_path / "victim")
        if name == "out.old":  # only in the way of what is set aside
            publish(tmp_path / "out")
            publish(tmp_path / "out")
        else:
            with pytest.raises(OutputError, match=r"is a link|has not made it"):
                publish(tmp_path / "out")
        link.unlink()
    assert (tmp_path / "victim" / "a.csv").read_text() == "precious"
    (tmp_path / "table").symlink_to(tmp_path / "victim" / "a.csv")
    with new_file(tmp_path / "table", "w") as file:
        file.write("new")
    assert (tmp_path / "victim" / "a.csv").read_text() == "precious"
    assert not (tmp_path / "table").is_symlink()


def test_the_working_folder_is_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    for path in (Path(), Path(".."), tmp_path):
        with pytest.raises(OutputError, match="working folder or above it"):
            NewFolder(path, "replay", force=True)
    assert files(tmp_path) == {}


def test_what_was_stopped_is_removed_by_the_next_run(tmp_path: Path) -> None:
    """A process that is killed loses its lock; as long as it lives nobody takes its folder."""
    ready, go = os.pipe()
    child = os.fork()
    if child == 0:
        new = NewFolder(tmp_path / "out", "replay")
        (new.part / "half.csv").write_text("1,2,")
        os.write(go, b"x")
        signal.pause()
    os.read(ready, 1)
    with pytest.raises(OutputError, match="being written by another auvest"):
        publish(tmp_path / "out")
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    assert files(tmp_path) == {"out.unfinished/half.csv": "1,2,"}
    with pytest.raises(OutputError, match="recorded when auvest was stopped"):
        publish(tmp_path / "out", precious=True)
    publish(tmp_path / "out")
    assert files(tmp_path) == {"out/a.csv": "new"}


@pytest.mark.parametrize("left", [(), (".auvest.json",), (".auvest.json.0123abcd.unfinished",)])
def test_a_stop_at_the_very_beginning_is_in_nobodys_way(
    tmp_path: Path, left: tuple[str, ...]
) -> None:
    (tmp_path / "out.unfinished").mkdir()
    for name in left:
        (tmp_path / "out.unfinished" / name).write_text("")
    publish(tmp_path / "out")
    assert files(tmp_path) == {"out/a.csv": "new"}


def test_a_stop_between_the_two_names_is_mended(tmp_path: Path) -> None:
    publish(tmp_path / "out", text="old")
    (tmp_path / "out").rename(tmp_path / "out.old")  # and there it was stopped
    with pytest.raises(KeyError), NewFolder(tmp_path / "out", "replay"):
        raise KeyError
    assert files(tmp_path) == {"out/a.csv": "old"}


def test_what_is_precious_stays_where_it_is(tmp_path: Path) -> None:
    with (
        pytest.raises(OSError, match="full"),
        NewFolder(tmp_path / "out", "capture", precious=True),
    ):
        raise OSError("the disk is full")
    assert list(tmp_path.iterdir()) == []  # nothing had come
    new = NewFolder(tmp_path / "out", "capture", precious=True)
    (new.part / "record.csv").write_text("1,2\n")
    new.discard()
    assert new.left == tmp_path / "out.unfinished"
    assert files(tmp_path) == {"out.unfinished/record.csv": "1,2\n"}


def test_an_unfinished_folder_of_somebody_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out.unfinished").mkdir()
    (tmp_path / "out.unfinished" / "thesis.tex").write_text("mine")
    with pytest.raises(OutputError, match="auvest has not made it"):
        publish(tmp_path / "out", force=True)
    assert files(tmp_path) == {"out.unfinished/thesis.tex": "mine"}


def test_a_file_takes_its_name_when_it_is_whole(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("old")
    with pytest.raises(TypeError), new_file(tmp_path / "t.csv", "w") as file:
        file.writelines(["ne", 1])  # type: ignore[list-item]
    assert files(tmp_path) == {"t.csv": "old"}


@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_waits_for_what_must_be_whole() -> None:
    done: list[int] = []

    def interrupted(part: int) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        done.append(part)

    def whole() -> None:
        with HeldInterrupts() as held:
            for part in range(3):
                with held:
                    interrupted(part)

    def outside() -> None:
        with HeldInterrupts():
            interrupted(7)

    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        whole()
    assert done == [0]  # to its end, and no further
    with pytest.raises(KeyboardInterrupt):
        outside()  # of the inner block it acts at once
    assert done == [0]
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_that_is_ignored_stays_so() -> None:
    """As under nohup, or in the background of a script."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with HeldInterrupts() as held:
        with held:
            os.kill(os.getpid(), signal.SIGINT)
        assert not held.take()
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
