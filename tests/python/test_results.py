"""Result: columns as attributes, by name, as a DataFrame and in a notebook."""

import copy
import pickle
import subprocess
import sys
from dataclasses import FrozenInstanceError, dataclass

import numpy as np
import pandas as pd
import pytest

from auvest.results import Result


@dataclass(frozen=True, repr=False, eq=False)
class Run(Result):
    time_s: np.ndarray
    x: np.ndarray
    P: np.ndarray
    nis: np.ndarray


@dataclass(frozen=True, repr=False, eq=False)
class Untimed(Result):
    count: np.ndarray


def make(**changes):
    columns = {
        "time_s": np.array([0.5, 1.5]),
        "x": np.array([[1, 2], [3, 4]], np.float32),
        "P": np.arange(8.0).reshape(2, 2, 2),
        "nis": np.array([0.25, np.nan]),
    }
    return Run(**{**columns, **changes})


def test_columns_are_attributes_and_items():
    result = make()
    assert result.columns == ("time_s", "x", "P", "nis")
    assert len(result) == 2
    assert result["x"] is result.x
    with pytest.raises(FrozenInstanceError):
        result.x = np.zeros(2)


def test_a_column_that_was_not_asked_for_is_not_there():
    result = make(P=None)
    assert result.columns == ("time_s", "x", "nis")
    with pytest.raises(AttributeError, match="P was not asked for: this Run has time_s, x, nis"):
        _ = result.P
    with pytest.raises(KeyError, match="P was not asked for"):
        _ = result["P"]
    assert "P_0_0" not in result.to_pandas()
    assert len(make(time_s=None)) == 2


def test_an_unknown_name_is_refused_with_those_that_exist():
    for name in ("y", "columns", "__len__"):
        with pytest.raises(KeyError, match=f"there is no {name}: this Run has time_s, x, P, nis"):
            _ = make()[name]
    with pytest.raises(AttributeError, match="there is no y: this Run has"):
        _ = make().y


def test_columns_of_different_length_are_refused():
    with pytest.raises(ValueError, match=r"columns differ in length: .*'nis': 3"):
        make(nis=np.zeros(3))


def test_pandas_has_one_column_per_element_and_time_as_index():
    frame = make().to_pandas()
    assert list(frame) == ["x_0", "x_1", "P_0_0", "P_0_1", "P_1_0", "P_1_1", "nis"]
    assert frame.index.name == "time_s"
    assert list(frame.index) == [0.5, 1.5]
    assert list(frame["x_1"]) == [2, 4]
    assert frame["x_1"].dtype == np.float32
    assert list(frame["P_0_1"]) == [1, 5]
    assert list(frame["P_1_0"]) == [2, 6]


def test_elements_are_named_by_their_place():
    frame = Untimed(count=np.arange(6).reshape(1, 2, 3)).to_pandas()
    assert frame.to_dict("records") == [{f"count_{i}_{j}": 3 * i + j for i, j in np.ndindex(2, 3)}]


def test_pandas_takes_the_columns_asked_for():
    frame = make().to_pandas(["nis", "x"])
    assert list(frame) == ["nis", "x_0", "x_1"]
    assert list(frame.index) == [0.5, 1.5]
    with pytest.raises(KeyError, match="there is no y"):
        make().to_pandas(["y"])


def test_pandas_numbers_the_rows_where_there_is_no_time():
    frame = Untimed(count=np.array([5, 6])).to_pandas()
    pd.testing.assert_frame_equal(frame, pd.DataFrame({"count": [5, 6]}))


def test_without_pandas_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ModuleNotFoundError, match="pip install pandas"):
        make().to_pandas()


def test_pandas_is_not_imported_before_it_is_needed():
    code = "import sys, auvest, auvest.results; sys.exit('pandas' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_text_and_notebook_show_what_there_is():
    result = make()
    assert repr(result) == "Run(2 rows: time_s (2,), x (2, 2), P (2, 2, 2), nis (2,))"
    html = result._repr_html_()
    assert "<caption>Run, 2 rows</caption>" in html
    assert "<th>x</th><td>(2, 2)</td><td>float32</td><td>[3., 4.]</td>" in html
    assert "<th>P</th><td>(2, 2, 2)</td><td>float64</td><td>[[4., 5.],\n [6., 7.]]</td>" in html
    large = Untimed(count=np.zeros((1, 6, 6)))._repr_html_()
    assert "<td>&hellip;</td>" in large
    assert "<td></td></tr>" in Untimed(count=np.zeros((0, 2)))._repr_html_()


@pytest.mark.parametrize(
    "twin_of", [copy.copy, copy.deepcopy, lambda r: pickle.loads(pickle.dumps(r))]
)
def test_copies_and_pickles_have_the_same_columns(twin_of):
    twin = twin_of(make(P=None))
    assert twin.columns == ("time_s", "x", "nis")
    np.testing.assert_array_equal(twin.x, make().x)
    with pytest.raises(AttributeError, match="P was not asked for"):
        _ = twin.P
