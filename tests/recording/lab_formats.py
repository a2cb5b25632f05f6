"""The same recording in the formats and dialects that laboratories keep."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

Columns = Mapping[str, np.ndarray]
START = 1_700_000_000_123_456_789
"""ns: today's clocks, of whose digits a double keeps the microseconds."""


def text(columns: Columns, comma: bool = False, mark: str = ",", top: str = "") -> str:
    rows = zip(*(values for values in columns.values()), strict=True)
    lines = [mark.join(f"{x:.15g}".replace(".", "," if comma else ".") for x in r) for r in rows]
    return top + mark.join(columns) + "\n" + "\n".join(lines) + "\n"


def csv_us(path: Path, columns: Columns) -> str:
    top = "# Rig 2, recorded on 2024-05-01\n# operator: nobody\n\n"
    (path / "us.csv").write_text(text(columns, top=top), encoding="utf-8")
    return "us.csv"


def csv_de(path: Path, columns: Columns) -> str:
    """Semicolons, decimal commas, a line of units; angles in degrees, the camera in mm."""
    units = {
        n: "s" if n == "t" else "deg" if n.startswith("theta") else "deg/s" if "d" in n else "mm"
        for n in columns
    }
    factors = {"s": 1.0, "deg": 180 / np.pi, "deg/s": 180 / np.pi, "mm": 1000.0}
    scaled = {n: factors[units[n]] * v for n, v in columns.items()}
    header, _, body = text(scaled, comma=True, mark=";").partition("\n")
    top = "Messung 17;;\nRegler: P\n"
    row = ";".join(f"[{unit}]" for unit in units.values())
    (path / "de.csv").write_text(f"{top}{header}\n{row}\n{body}", encoding="latin-1")
    return "de.csv"


def csv_tab(path: Path, columns: Columns) -> str:
    (path / "export.dat").write_text(text(columns, mark="\t"), encoding="utf-8")
    return "export.dat"


def csv_gz(path: Path, columns: Columns) -> str:
    (path / "packed.csv.gz").write_bytes(gzip.compress(text(columns).encode()))
    return "packed.csv.gz"


def parquet(path: Path, columns: Columns) -> str:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table(dict(columns)), path / "table.parquet")
    return "table.parquet"


def mat5(path: Path, columns: Columns) -> str:
    from scipy.io import savemat

    savemat(path / "old.mat", dict(columns))
    return "old.mat"


def mat73(path: Path, columns: Columns) -> str:
    """As MATLAB writes it: 512 bytes of its own, and row vectors (N, 1) on disk."""
    import h5py

    file = path / "new.mat"
    with h5py.File(file, "w", userblock_size=512) as made:
        group = made.create_group("rig")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values in columns.items():
            group.create_dataset(name, data=values[:, None]).attrs["MATLAB_class"] = np.bytes_(
                "double"
            )
        text_ = np.array([[ord(c)] for c in "rad"], dtype=np.uint16)
        units = made.create_group("units")
        units.create_dataset("theta1", data=text_).attrs["MATLAB_class"] = np.bytes_("char")
    with file.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return "new.mat"


def hdf5(path: Path, columns: Columns) -> str:
    """Joints as one array, the camera in mm by its attribute."""
    import h5py

    with h5py.File(path / "run.h5", "w") as made:
        group = made.create_group("run/signals")
        group["time"] = columns["t"]
        group["theta"] = np.column_stack([columns["theta1"], columns["theta2"]])
        for name in columns:
            if name.startswith("z"):
                group.create_dataset(name, data=1000.0 * columns[name]).attrs["units"] = "mm"
            elif name.endswith("_ref"):
                group[name] = columns[name]
        made["notes"] = "one experiment"
    return "run.h5"


def _bag(path: Path, columns: Columns, plugin: Any, ending: str) -> str:
    """Encoders and references as JointState with swapped order; the camera as numbers."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    make: Any = store.types
    state, number = make["sensor_msgs/msg/JointState"], make["std_msgs/msg/Float64"]
    header, stamp = make["std_msgs/msg/Header"], make["builtin_interfaces/msg/Time"]
    room = path / f"bag_{ending}"
    with Writer(room, version=9, storage_plugin=plugin) as bag:
        kinds = {"/joint_states": state, "/joint_commands": state, "/camera/z1": number,
                 "/camera/z2": number}  # fmt: skip
        opened = {
            topic: bag.add_connection(topic, kind.__msgtype__, typestore=store)
            for topic, kind in kinds.items()
        }
        empty = np.array([])
        for k, t in enumerate(columns["t"]):
            ns = START + round(1e9 * float(t))
            head = header(stamp(ns // 10**9, ns % 10**9), "")
            angles, rates = (
                np.array([columns[name][k] for name in pair])
                for pair in (("theta2", "theta1"), ("dtheta2_ref", "dtheta1_ref"))
            )
            names = ["joint_2", "joint_1"]
            made = {
                "/joint_states": state(head, names, angles, empty, empty),
                "/joint_commands": state(head, names, empty, rates, empty),
                "/camera/z1": number(float(columns["z1"][k])),
                "/camera/z2": number(float(columns["z2"][k])),
            }
            for topic, message in made.items():
                raw = store.serialize_cdr(message, kinds[topic].__msgtype__)
                bag.write(opened[topic], ns, raw)
    return f"{room.name}/{room.name}.{ending}"


def mcap(path: Path, columns: Columns) -> str:
    from rosbags.rosbag2 import StoragePlugin

    return _bag(path, columns, StoragePlugin.MCAP, "mcap")


def db3(path: Path, columns: Columns) -> str:
    from rosbags.rosbag2 import StoragePlugin

    return _bag(path, columns, StoragePlugin.SQLITE3, "db3")


def tdms(path: Path, columns: Columns) -> str:
    from nptdms import ChannelObject, TdmsWriter

    step = float(columns["t"][1] - columns["t"][0])
    properties = {"wf_increment": step, "wf_start_offset": float(columns["t"][0])}
    channels = [
        ChannelObject("rig", name, values, properties=properties)
        for name, values in columns.items()
        if name != "t"
    ]
    with TdmsWriter(path / "run.tdms") as writer:
        writer.write_segment(channels)
    return "run.tdms"


def mdf4(path: Path, columns: Columns) -> str:
    from asammdf import MDF, Signal

    time = columns["t"]
    signals = [
        Signal(values, time, name=name, unit="deg" if name == "theta1" else "")
        for name, values in {**columns, "theta1": np.rad2deg(columns["theta1"])}.items()
        if name != "t"
    ]
    with MDF(version="4.10") as made:
        made.append(signals, acq_name="rig")
        made.save(path / "run.mf4", overwrite=True)
    return "run.mf4"


def npz(path: Path, columns: Columns) -> str:
    np.savez_compressed(path / "run.npz", **columns)
    return "run.npz"


def lerobot(path: Path, columns: Columns) -> str:
    """As data sets of version 2.1 keep it: float32 times, vectors, meta/info.json."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    state = ["theta1", "theta2", "z1", "z2"]
    action = ["dtheta1_ref", "dtheta2_ref"]
    rows = len(columns["t"])
    rate = round(1.0 / float(columns["t"][1] - columns["t"][0]))
    vectors = {
        "observation.state": pa.array(np.column_stack([columns[n] for n in state]).tolist()),
        "action": pa.array(np.column_stack([columns[n] for n in action]).tolist()),
    }
    frames = np.arange(rows)
    table = {
        **vectors,
        "timestamp": pa.array((frames / rate).astype(np.float32)),
        "frame_index": pa.array(frames),
        "episode_index": pa.array(np.zeros(rows, dtype=int)),
    }
    folder = path / "set/data/chunk-000"
    folder.mkdir(parents=True)
    (path / "set/meta").mkdir()
    pq.write_table(pa.table(table), folder / "episode_000000.parquet")
    features = {
        "observation.state": {"dtype": "float64", "shape": [4], "names": state},
        "action": {"dtype": "float64", "shape": [2], "names": {"motors": action}},
    }
    info = {"codebase_version": "v2.1", "fps": rate, "features": features}
    (path / "set/meta/info.json").write_text(json.dumps(info), encoding="utf-8")
    return "set/data/chunk-000/episode_000000.parquet"


FORMATS: dict[str, Callable[[Path, Columns], str]] = {
    each.__name__: each
    for each in (
        csv_us, csv_de, csv_tab, csv_gz, parquet, mat5, mat73, hdf5, mcap, db3, tdms, mdf4, npz,
        lerobot,
    )
}  # fmt: skip
"""Each writes the columns into a folder and gives the name of the file that a scenario names."""
