"""A few kills of every command that writes; `python -m tests.attacks.kill` does many."""

import resource
from pathlib import Path

import pytest

from tests.attacks.kill import ATTACKS, FAULTS, VARIANTS, attack, digests, finish


@pytest.mark.parametrize("name", sorted(set(ATTACKS) - {"replay"}))  # whose figures take seconds
def test_a_kill_leaves_the_old_or_the_new(name: str, tmp_path: Path) -> None:
    counts = attack(name, 4, 1, tmp_path)
    assert counts["killed"] == 4
    assert {fault: counts[fault] for fault in FAULTS} == dict.fromkeys(FAULTS, 0)


def test_what_is_mixed_or_truncated_is_noticed() -> None:
    made = ATTACKS["simulate"]()
    wanted = {"a": {"t.csv": "1", "u.csv": "2"}, "b": {"t.csv": "3", "u.csv": "4"}}
    assert set(wanted) == set(VARIANTS)
    judged = {}
    for case, tree in {
        "a": {"t.csv": "1", "u.csv": "2"},
        "mixed": {"t.csv": "1", "u.csv": "4"},
        "missing": {"t.csv": "1"},
        "truncated": {"t.csv": "1", "u.csv": "0"},
    }.items():
        judged[case] = made.verdict(tree, wanted)
    assert judged == {"a": "a", "mixed": "mixed", "missing": "mixed", "truncated": "truncated"}


@pytest.mark.parametrize("name", ["import", "reproduce", "simulate"])
def test_a_full_disk_leaves_the_old(name: str, tmp_path: Path) -> None:
    made = ATTACKS[name]()
    made.prepare(tmp_path)
    first, second = VARIANTS
    finish(lambda: made.run(tmp_path, first), None)
    before = digests(tmp_path)

    def write_on_a_full_disk() -> None:
        _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (400, most))
        made.run(tmp_path, second)

    with pytest.raises(RuntimeError, match="has failed"):
        finish(write_on_a_full_disk, None)
    assert digests(tmp_path) == before  # and nothing unfinished beside it
