"""A small share of the campaign's damaged files; the whole of it is run by itself."""

from __future__ import annotations

import json
import random
from pathlib import Path

import pytest

from freeswing.cdpr.files.problems import DataError, InputError
from freeswing.servo.files.controller_file import read_controller
from tests.freeswing.hostile.campaign import SLOW_KINDS
from tests.freeswing.hostile.hostile_files import vandalised
from tests.freeswing.hostile.more_files import more_cases

FILES_A_KIND = 4


@pytest.mark.filterwarnings("ignore::RuntimeWarning", "ignore::UserWarning")
def test_some_files_of_each_further_kind(tmp_path: Path) -> None:
    (tmp_path / "made").mkdir()
    cases = more_cases(tmp_path / "made")
    assert len(cases) > 30
    folder, wrong = tmp_path / "files", {}
    for name, case in cases.items():
        if name.startswith(SLOW_KINDS):
            continue
        chance = random.Random(name)
        for k in range(FILES_A_KIND + 1):
            path = case.laid(folder, vandalised(case.data, chance) if k else case.data)
            try:
                case.read(path)
            except (InputError, DataError) as error:
                if k == 0:
                    wrong[name] = f"the whole file is refused: {error}"
            except Exception as error:  # noqa: BLE001
                wrong[name] = repr(error)
    assert wrong == {}


def test_a_controller_with_a_number_of_400_digits(tmp_path: Path) -> None:
    path = tmp_path / "controller.json"
    table = {"format": "freeswing-controller/1", "sample_rate_hz": int("9" * 400)}
    path.write_text(json.dumps(table), encoding="utf-8")
    with pytest.raises(InputError, match="not a controller"):
        read_controller(path)
