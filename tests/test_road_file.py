"""Samples of a road from a file: what is read, cleaned and refused, with the number of the line."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

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
        (b"\x00\x01\x02\xff", "is not a text file"),
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


HEADERS = [
    "Profile 12 of the A6, 2024-05-03 10:15",
    "Filter: Gauss, cutoff 0.8 mm, 1,5 mm",
    "12.05.2024",
    "Date;2024-05-03",
    "Operator\tJ. Doe",
    "# spacing 0.5",
    "% 1 2",
    "[data]",
    "",
]
FOOTERS = ["End of data", "", "Mean;0", "# 3 4", "checksum: ok"]


@st.composite
def files(draw):
    """A profile or a lattice of heights, and a text that an instrument might write of it."""
    count = draw(st.integers(2, 12))
    number = st.floats(-1e3, 1e3).map(lambda value: round(value, 4))
    positions = draw(st.lists(number, min_size=count, max_size=count, unique=True))
    heights = draw(st.lists(number, min_size=count, max_size=count))
    lattice = draw(st.booleans())
    rows = [[x, z] for x, z in zip(positions, heights)]
    if lattice:
        rows = [[x, y, z + y] for x, z in zip(positions, heights) for y in (0.0, 1.5)]
    decimal = draw(st.sampled_from(".,"))
    separator = draw(st.sampled_from([";", "\t", " ", "   ", "; "] + [",", ", "] * (decimal == ".")))
    mark = draw(st.sampled_from(["Bad", "NaN", "-9999", "n/a"] + ["", " "] * (";" in separator)))
    missing = draw(st.sets(st.integers(1, len(rows) - 1), max_size=1))
    form = draw(st.sampled_from(["{}", "{:.4f}", "{:.10e}"]))

    def word(value):
        return form.format(value).replace(".", decimal)

    lines = [
        draw(st.lists(st.sampled_from(HEADERS), max_size=4)),
        [],
        draw(st.lists(st.sampled_from(FOOTERS))),
    ]
    if draw(st.booleans()):
        lines[0].append(separator.join(["x", "y", "z"] if lattice else ["x", "z"]))
    tail = draw(st.sampled_from(["", ";"])) if separator == ";" else ""
    for k, row in enumerate(rows):
        words = [word(value) for value in row]
        lines[1].append(separator.join(words[:-1] + [mark] if k in missing else words) + tail)
    newline = draw(st.sampled_from(["\n", "\r\n"]))
    text = newline.join(sum(lines, [])) + draw(st.sampled_from(["", newline]))
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "latin-1", "utf-16-le", "utf-16-be"]))
    kept = np.array([row for k, row in enumerate(rows) if k not in missing])
    return kept, text.encode(encoding), bool(missing)


@given(files())
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@pytest.mark.filterwarnings("ignore:.*without a height")
def test_whatever_an_instrument_writes_is_read_as_it_was_meant(tmp_path, case):
    rows, text, missing = case
    path = written(tmp_path, text)
    if missing:
        with pytest.raises(ValueError, match="the height is missing"):
            read_samples(path)
    positions, heights = read_samples(path, clean=missing)
    order = np.lexsort(rows[:, :-1].T[::-1])
    read = np.column_stack([positions, heights])
    np.testing.assert_allclose(read[np.lexsort(read[:, :-1].T[::-1])], rows[order], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "text, unit, units, expected",
    [
        ("x [mm];z [\N{MICRO SIGN}m]\n0;1\n1;2", None, None, (1, 1e-3)),
        ("x (mm), z (mm)\n0,1\n1,2", None, None, (1, 1)),
        ("x/mm z/um\n0 1\n1 2", "m", None, (1e-3, 1e-6)),
        ("Position\tHeight\nmm\tum\n0\t1\n1\t2", "um", None, (1e3, 1)),
        ("Unit: inch\n0 1\n1 2", "mm", None, (25.4, 25.4)),
        ("# units = um\n0 1\n1 2", "mm", None, (1e-3, 1e-3)),
        ("length [m] against height [mm]\n0 1\n1 2", None, None, (1, 1e-3)),
        ("position_m,height_mm\n0,1\n1,2", "mm", None, (1e3, 1)),
        ("0 1\n1 2", "m", "mm", (1e-3, 1e-3)),
        ("x [m] z [m]\n0 1\n1 2", "m", ("mm", "um"), (1e-3, 1e-6)),
        ("position in millimetres;height in microns\n0;1\n1;2", "mm", None, (1, 1e-3)),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "latin-1", "utf-16"])
def test_units_that_the_file_names(tmp_path, text, unit, units, expected, encoding):
    positions, heights = read_samples(written(tmp_path, text.encode(encoding)), unit=unit, units=units)
    np.testing.assert_allclose(positions, np.array([0, 1]) * expected[0])
    np.testing.assert_allclose(heights, np.array([1, 2]) * expected[1])


def test_columns_by_name_and_number(tmp_path):
    path = written(tmp_path, "way [m];left [mm];right [mm]\n0;1;2\n1;3;4\n2;5;6\n")
    for columns in (("way", "right"), (0, 2), ("way [m]", 2)):
        positions, heights = read_samples(path, columns=columns)
        np.testing.assert_allclose(positions, [0, 1, 2])
        np.testing.assert_allclose(heights, [2e-3, 4e-3, 6e-3])
    scattered = written(tmp_path, "X;Y;height\n0,1;0,5;1\n1,2;0,7;3\n0,4;2,2;5\n")
    assert read_samples(scattered)[0].shape == (3, 2)


@pytest.mark.parametrize(
    "text, options, words",
    [
        ("0.0;1.x2\n1;2\n2;3\n", {}, "line 1: '1.x2' is not a number"),
        ("O.0;1.2\n1;2\n2;3\n", {}, "line 1: 'O.0' is not a number"),
        ("x;z\n1;2\n2;3\n3;4o\n", {}, "line 4: '4o' is not a number"),
        ("0.5;1\n1,5;2\n2.5;3\n", {}, "line 2: '1,5' is not a number; write decimals with a point"),
        ("0,5;1\n1.5;2\n2,5;3,5\n", {}, "line 2: '1.5' is not a number; write decimals with a comma"),
        ("0 1\n1 2\nhello there\n2 3\n", {}, "line 3: 'hello' is not a number"),
        ("0 1 5\n1 2 6\n2 3 7\n", {}, "3 columns, and nothing says .* columns="),
        ("0,5,1,2\n1,5,3,4\n", {}, "4 columns"),
        ("x left right\n0 1 5\n0 2 6\n2 1 7\n2 2 8\n", {}, r"columns=\(...\) from 0 \(x\), 1 \(left\)"),
        ("way;z\n0;1\n1;2\n", {"columns": ("x", "z")}, "no column 'x' alone; .* 0 \\(way\\), 1 \\(z\\)"),
        ("0;1\n1;2\n", {"columns": (0, 7)}, "no column 7"),
        ("0;1\n1;2\n", {"columns": (0, 0)}, "2 or 3 different ones"),
        ("0;1\n1;2\n", {"unit": "mm"}, "names no unit of length for any"),
        ("x [mm];z\n0;1\n1;2\n", {}, "names no unit of length for some"),
        ("0;1\n1;2\n", {"unit": "furlong"}, "'furlong' is no unit of length"),
        ("0;1\n1;2\n", {"units": ("mm", "mm", "mm")}, "3 units are given for 2 columns"),
        ("0;1\n1;-9999\n2;3\n", {}, "line 2: the height is missing"),
    ],
)
def test_never_a_guess(tmp_path, text, options, words):
    with pytest.raises(ValueError, match=words):
        read_samples(written(tmp_path, text), **options)


def test_a_height_of_minus_9999_between_others_is_one(tmp_path):
    heights = read_samples(written(tmp_path, "0 -20000\n1 -9999\n2 5\n"))[1]
    np.testing.assert_array_equal(heights, [-20000, -9999, 5])


def test_the_number_of_samples_above_them_is_none(tmp_path):
    assert read_samples(written(tmp_path, "3\n0 1\n1 2\n2 5\n"))[1].tolist() == [1, 2, 5]
    with pytest.raises(ValueError, match="line 1: there are 1 numbers"):
        read_samples(written(tmp_path, "4\n0 1\n1 2\n2 5\n"))
