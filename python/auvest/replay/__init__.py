"""Replaying recorded runs through the filters: settings, the replay, its results and report."""

from __future__ import annotations

from auvest.replay.config import Settings, find_settings, read_settings, settings_from
from auvest.replay.run import Result, replay

__all__ = ["Result", "Settings", "find_settings", "read_settings", "replay", "settings_from"]
