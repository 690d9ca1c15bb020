"""Samples of a road from a file: what is read, cleaned and refused, with the number of the line."""

import numpy as np
import pytest

from geometry import read_samples


def written(folder, text):
    path = folder / "road.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize(
    "text",
    [
        "0,1\n1,2\n3,5\n",
        "x,height\n0,1\n1,2\n3,5",
        "# a road\n\n0 1\n1\t2\n3  5\n",
        "\ufeffx;z\r\n0;1\r\n1;2\r\n3;5\r\n",
    ],
)
def test_separators_headers_and_comments(tmp_path, text):
    positions, heights = read_samples(written(tmp_path, text))
    assert np.array_equal(positions, [0, 1, 3]) and np.array_equal(heights, [1, 2, 5])


def test_surfaces_have_three_columns(tmp_path):
    positions, heights = read_samples(written(tmp_path, "0,0,1\n1,0,2\n0,1,3\n"))
    assert np.array_equal(positions, [[0, 0], [1, 0], [0, 1]]) and np.array_equal(heights, [1, 2, 3])


@pytest.mark.parametrize(
    "text, words",
    [
        ("0,1\n1,abc\n", "line 2: 'abc' is not a number"),
        ("x,z\n0,1\n1,2\n2;1,5", "line 4: '1,5' is not a number; write decimals with a point"),
        ("0,1\n\n1,2,3\n", "line 3: there are 3 numbers, but 2"),
        ("1\n2\n", "line 1: there are 1 numbers, but 2"),
        ("# none\n", "has no samples"),
        ("0,1\n1,nan\n", "line 2: the height is missing"),
        ("0,1\n1,\n", "line 2: the height is missing"),
        ("0,1\n1,2\n\n1,3\n", "line 4: the position is that of line 2"),
        ("0,1\n1,inf\n", "line 2: the numbers must be finite"),
        ("0,1\nnan,1\n", "line 2: the numbers must be finite"),
        (b"\xff\xfe0\x00", "is not a text file"),
    ],
)
def test_files_are_refused_in_one_sentence(tmp_path, text, words):
    with pytest.raises(ValueError, match=words) as caught:
        read_samples(written(tmp_path, text))
    assert str(caught.value).count(". ") == 0 and "\n" not in str(caught.value)


def test_files_are_cleaned_with_a_message(tmp_path):
    path = written(tmp_path, "0,1\n1,nan\n2,\n3,4\n3,6\n")
    with pytest.warns(UserWarning) as messages:
        positions, heights = read_samples(path, clean=True)
    assert np.array_equal(positions, [0, 3]) and np.array_equal(heights, [1, 5])
    said = " ".join(str(m.message) for m in messages)
    assert "2 samples without a height were left out, the first on line 2" in said
    assert "1 samples repeat a position, the first on line 5" in said


def test_files_that_are_not_there(tmp_path):
    with pytest.raises(ValueError, match="cannot be read"):
        read_samples(tmp_path / "none.csv")
    with pytest.raises(ValueError, match="cannot be read"):
        read_samples(tmp_path)
