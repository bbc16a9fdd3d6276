"""Results for other programs: what xarray and pandas make of a results file without a word about it."""

import sys
from pathlib import Path

import numpy as np
import pandas
import pytest
import xarray
from numpy.testing import assert_array_equal

from kedfem.analysis import analyse
from kedfem.errors import OutputError
from kedfem.results import Channel, Results, ResultsWriter, on_demand, read_results, table, write_csv, write_parquet
from kedfem.results.additions import add_account
from kedfem.results.channels import ANGLE, TRAVEL
from kedfem.results.dimensions import columns_dimension
from kedfem.scene import scene_from
from tests.scenes import example

STRESS = ("xx", "yy", "zz", "xy", "yz", "zx", "von_mises")
CHANNELS = [
    Channel("probes/mid 1/stress", STRESS, "Pa", "link", "stress at the rod's middle"),
    Channel("probes/tip/displacement", ("x", "y"), "m", "world", "displacement of the tip"),
    Channel("joints/B-2/force", ("x", "y", "z"), "N", "world", "force of joint B-2 on link rod from crank"),
    Channel("drive/torque", ("torque",), "N m", "world", "torque of the drive on link crank"),
    Channel("energy/work", ("loads", "supports"), "J", "", "work done"),
    Channel("gears/g/ratio", ("ratio",), "", "", "a ratio"),
]
ENGINES = ["h5netcdf", "netcdf4"]


def written(path: Path, drive: Channel = ANGLE, count: int = 700) -> dict[str, np.ndarray]:
    """A whole run in two blocks, and its rows by channel."""
    step = np.arange(count)
    rows = {c.name: step[:, None] / 7 + np.arange(len(c.columns)) for c in CHANNELS}
    with ResultsWriter(path, CHANNELS, '{"title": "x"}', None, {"alpha": 0.25}, drive) as file:
        for part in (slice(0, 5), slice(5, count)):
            file.append(step[part] * 1e-3, step[part] * 0.1, {name: x[part] for name, x in rows.items()})
    add_account(path, ["the step is long"], {"steps": 1.5})
    return rows


@pytest.mark.parametrize("kept", [0, 10**9])
def test_channels_of_large_files_are_read_when_they_are_asked_for(
    tmp_path: Path, kept: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = written(tmp_path / "results.h5")
    whole = read_results(tmp_path / "results.h5")
    assert isinstance(whole.channels, dict)
    write_csv(whole, tmp_path / "whole.csv")
    monkeypatch.setattr(on_demand, "AT_ONCE", 0)
    monkeypatch.setattr(on_demand, "KEPT", kept)
    monkeypatch.setattr(table, "ROWS", 300)
    results = read_results(tmp_path / "results.h5")
    assert not isinstance(results.channels, dict)
    assert list(results.channels) == list(rows)
    for name, values in rows.items():
        for _ in range(2):
            channel, found = results.channels[name]
            assert channel == whole.channels[name][0]
            assert_array_equal(found, values)
            assert not found.flags.writeable
    write_csv(results, tmp_path / "later.csv")
    assert (tmp_path / "later.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
    some = on_demand.selection(results.channels, ("drive/torque",))
    assert isinstance(some, on_demand.OnDemand)
    assert list(some) == ["drive/torque"]
    assert "gears/g/ratio" not in some
    add_account(tmp_path / "results.h5", ["one more"], {"steps": 1.5})  # adds to the file, whose rows are the same
    assert_array_equal(read_again(results, "gears/g/ratio"), rows["gears/g/ratio"])


def read_again(results: Results, name: str) -> np.ndarray:
    results.channels.cached.clear()  # type: ignore[attr-defined]
    return results.channels[name][1]


def test_a_file_that_became_another_is_not_read_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "results.h5"
    written(path)
    monkeypatch.setattr(on_demand, "AT_ONCE", 0)
    results = read_results(path)
    written(path, count=300)
    with pytest.raises(OutputError, match="must be the results file that was opened, got that of another run"):
        read_again(results, "drive/torque")
    path.write_bytes(b"nothing")
    with pytest.raises(OutputError, match=r"results.h5: .* got a corrupt file"):
        read_again(results, "drive/torque")
    path.unlink()
    with pytest.raises(OutputError, match=r"got a corrupt file|no such file"):
        read_again(results, "drive/torque")


@pytest.mark.parametrize("drive", [ANGLE, TRAVEL], ids=lambda x: x.name)
@pytest.mark.parametrize("engine", ENGINES)
def test_xarray_opens_every_channel_with_dimensions_coordinates_and_units(
    tmp_path: Path, engine: str, drive: Channel
) -> None:
    rows = written(tmp_path / "results.h5", drive)
    with xarray.open_datatree(tmp_path / "results.h5", engine=engine) as tree:
        assert tree.ds[drive.name].dims == ("time",)
        assert drive.name in tree.coords
        assert tree.ds[drive.name].attrs["units"] == drive.unit
        assert (tree.coords["time"].attrs["units"], tree.coords["time"].attrs["long_name"]) == ("s", "time")
        assert tree.attrs["Conventions"].startswith("CF-")
        for channel in CHANNELS:
            found, name = tree[channel.name], columns_dimension(channel.columns)
            assert found.dims == (("time", name) if name else ("time",))
            assert_array_equal(found.coords["time"], np.arange(700) * 1e-3)
            if name:
                assert found.coords[name].values.tolist() == list(channel.columns)
                one = found.sel({name: channel.columns[1]})
                assert_array_equal(one.values, rows[channel.name][:, 1])
            assert_array_equal(found.values.reshape(rows[channel.name].shape), rows[channel.name])
            said = {key: found.attrs[key] for key in ("units", "long_name", "frame")}
            assert said == {
                "units": channel.unit or "1", "long_name": channel.description, "frame": channel.frame
            }  # fmt: skip


@pytest.mark.parametrize("engine", ENGINES)
def test_xarray_shows_what_the_run_said_of_itself(tmp_path: Path, engine: str) -> None:
    written(tmp_path / "results.h5")
    with xarray.open_datatree(tmp_path / "results.h5", engine=engine) as tree:
        assert tree.attrs["status"] == "complete"
        assert tree["warnings"].attrs == {"warning 1": "the step is long"}
        assert tree["timing"].attrs == {"steps": 1.5}
        assert tree["notes"].attrs == {"alpha": 0.25}


@pytest.mark.parametrize("engine", ENGINES)
def test_one_group_opens_as_a_data_set_and_becomes_a_data_frame(tmp_path: Path, engine: str) -> None:
    rows = written(tmp_path / "results.h5")
    with xarray.open_dataset(tmp_path / "results.h5", engine=engine, group="joints/B-2") as one:
        table = one.to_dataframe()["force"].unstack("xyz")
    assert_array_equal(table.to_numpy(), rows["joints/B-2/force"])


def test_a_stopped_run_opens_too(tmp_path: Path) -> None:
    def stopped() -> None:
        with ResultsWriter(tmp_path / "results.h5", CHANNELS, "{}", None, {}) as file:
            file.append(np.arange(3.0), np.arange(3.0), {c.name: np.ones((3, len(c.columns))) for c in CHANNELS})
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    with xarray.open_datatree(tmp_path / "results.h5", engine="h5netcdf") as tree:
        assert (tree.attrs["status"], tree.sizes["time"]) == ("interrupted", 3)
    assert read_results(tmp_path / "results.h5").status == "interrupted"


@pytest.mark.parametrize("drive", [ANGLE, TRAVEL], ids=lambda x: x.name)
def test_a_data_tree_of_results_is_that_of_the_file(tmp_path: Path, drive: Channel) -> None:
    written(tmp_path / "results.h5", drive, 20)
    tree = read_results(tmp_path / "results.h5").to_xarray()
    with xarray.open_datatree(tmp_path / "results.h5", engine="h5netcdf") as file:
        for channel in CHANNELS:
            one, other = tree[channel.name], file[channel.name]
            xarray.testing.assert_equal(one.drop_vars(drive.name), other)
            assert {key: other.attrs[key] for key in one.attrs} == one.attrs
            assert_array_equal(one.coords[drive.name], file[drive.name])
        assert tree.attrs == {key: file.attrs[key] for key in tree.attrs}
    tree.to_netcdf(tmp_path / "copy.nc")


def test_tables_have_the_same_names_and_numbers(tmp_path: Path) -> None:
    """A data frame, Parquet to the last bit, CSV to nine digits."""
    rows = written(tmp_path / "results.h5")
    results = read_results(tmp_path / "results.h5")
    table = results.to_pandas()
    assert table.index.name == "time [s]"
    assert table.columns[:2].tolist() == ["drive angle [rad]", "probes/mid 1/stress xx [Pa]"]
    assert_array_equal(table["joints/B-2/force y [N]"], rows["joints/B-2/force"][:, 1])
    write_parquet(results, tmp_path / "results.parquet")
    write_csv(results, tmp_path / "results.csv")
    pandas.testing.assert_frame_equal(pandas.read_parquet(tmp_path / "results.parquet"), table, check_exact=True)
    read = pandas.read_csv(tmp_path / "results.csv", index_col=0)
    pandas.testing.assert_frame_equal(read, table, rtol=5e-9, atol=0.0)


@pytest.mark.parametrize(("missing", "where"), [("xarray", "to_xarray"), ("pandas", "to_pandas"), ("pyarrow", "parquet")])
def test_what_is_not_installed_is_said_with_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, missing: str, where: str
) -> None:
    """Parquet before anything is computed: there is no folder."""
    written(tmp_path / "results.h5", count=7)
    results = read_results(tmp_path / "results.h5")
    monkeypatch.setitem(sys.modules, missing, None)
    message = rf"{where}: needs {missing}, which is not installed: pip install 'kedfem\[data\]'$"
    raw = example("four_bar_beams") | {"output": {"parquet": True, "folder": str(tmp_path / "none")}}
    tries = {"xarray": results.to_xarray, "pandas": results.to_pandas, "pyarrow": lambda: analyse(scene_from(raw))}
    with pytest.raises(OutputError, match=message):
        tries[missing]()
    assert not (tmp_path / "none").exists()
