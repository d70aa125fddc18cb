"""The attack on the serial line: short, and against a checksum that is too weak."""

import random
from functools import reduce
from operator import xor

from auvest import telemetry
from firmware import line_attack

pytest_plugins = ["closed_loop_support"]


def test_no_damaged_answer_is_taken_for_another_value():
    counts = line_attack.attack_answers(5000, random.Random(2))
    assert counts["accepted_wrong"] == 0
    assert counts["believed"] > 20  # those behind the rest of another line


def test_a_line_of_any_length_can_be_damaged():
    dice = random.Random(3)
    for _ in range(5_000):
        line = "".join(dice.choices("0123456789$,*AUV", k=dice.randint(4, 8)))
        damaged = line_attack.damaged(line, line + "7", dice)
        assert damaged
        assert damaged != line.encode()


def test_no_damaged_report_is_taken_for_another_value():
    counts = line_attack.attack_reports(5000, random.Random(2))
    assert counts["accepted_wrong"] == 0
    assert counts["tried"] == 5000


def test_no_damaged_answer_moves_the_chip(build_loop, runner):
    counts = line_attack.attack_chip(300, random.Random(2), build_loop().elf, runner)
    assert counts["tried"] >= 300
    assert counts["accepted_wrong"] == 0


def test_the_attack_sees_what_an_exclusive_or_lets_pass(monkeypatch):
    body = telemetry.body_of(line_attack.DESCRIPTION)

    def exclusive_or(body):
        return reduce(xor, body.encode("latin-1"), 0)

    monkeypatch.setattr(telemetry, "_checksum", exclusive_or)
    monkeypatch.setattr(line_attack, "DESCRIPTION", telemetry.frame(body))
    counts = line_attack.attack_reports(3000, random.Random(2))
    assert counts["accepted_wrong"] > 10
