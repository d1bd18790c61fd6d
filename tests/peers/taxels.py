"""Forces on taxels as other programs read them: their sums beside the force of an ideal sensor.

    pip install numpy==2.4.6 pyarrow==26.0.1 mcap-ros2-support==0.6.0 'rerun-sdk[catalog]==0.41.0'
    palpate trials export 1 2 --taxels --out taxels.npz     # likewise taxels.parquet and taxels.mcap
    python tests/peers/taxels.py taxels.npz taxels.parquet taxels.mcap

Of each file and reader it prints samples, the shape of the pads, and by how much the sum of normal forces over a pad differs from
`force_left` and `force_right`, which must stay below 1e-5 N. Rerun loads the gripper and the link of the object, but not its
mesh: it reads no data URI, and says so. Nothing of Palpate is used.
"""

import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

LIMIT = 1e-5  # N
FORCES = ["force_left", "force_right"]


def npz(path):
    """Sums over pads, forces of ideal sensors (samples, fingers), and shapes."""
    file = np.load(path)
    normal, position = file["taxel_normal"], file["taxel_position"]
    assert file["taxel_shear"].shape == (*normal.shape, 2) and position.shape == (len(normal), *normal.shape[2:], 3)
    column = [list(file["channels"]).index(name) for name in FORCES]
    there = np.isfinite(normal).all((2, 3, 4))
    return normal.sum((3, 4), dtype=float)[there], file["values"][..., column][there], normal.shape


def parquet(path):
    import pyarrow.parquet

    table = pyarrow.parquet.read_table(path)
    pads = json.loads(table.schema.metadata[b"taxels"])
    sums, forces = [], []
    for pad in pads:
        rows = table.filter(pyarrow.compute.is_in(table["trial"], pyarrow.array(pad["trials"])))
        normal = np.stack(rows["taxel_normal"].to_numpy()).reshape(-1, *pad["shape"])
        shear = np.stack(rows["taxel_shear"].to_numpy()).reshape(-1, *pad["shape"], 2)
        assert len(shear) == len(normal) and np.shape(pad["position"]) == (np.prod(pad["shape"]), 3)
        sums.append(normal.sum((2, 3), dtype=float))
        forces.append(np.stack([rows[name].to_numpy() for name in FORCES], 1))
    return np.concatenate(sums), np.concatenate(forces), [pad["shape"] for pad in pads]


def mcap(path):
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    sums, forces, shape, lines = {}, {}, None, 0
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            time = message.log_time
            if channel.topic == "/palpate/taxels":
                axes = decoded.layout.dim
                assert [axis.label for axis in axes] == ["finger", "row", "column", "force"]
                shape = [axis.size for axis in axes]
                assert [axis.stride for axis in axes] == [int(np.prod(shape[k:])) for k in range(4)]
                taxels = np.array(decoded.data).reshape(shape)
                sums[time] = taxels[..., 0].sum((1, 2), dtype=float)
                loaded = [int((finger[..., 0] > 0).sum()) for finger in taxels]
            elif channel.topic == "/palpate/forces":
                assert [len(marker.points) for marker in decoded.markers] == [2 * count for count in loaded]
                assert all(marker.type == 5 and marker.header.frame_id == "world" for marker in decoded.markers)
                lines += sum(loaded)
            elif channel.topic == "/palpate/channels":
                names = json.loads(channel.metadata["names"])
                if set(FORCES) <= set(names):
                    forces[time] = [decoded.data[names.index(name)] for name in FORCES]
            elif channel.topic == "/robot_description":
                assert '<link name="object">' in decoded.data and "data:model/stl;base64," in decoded.data
    times = sorted(sums)
    return np.array([sums[t] for t in times]), np.array([forces[t] for t in times]), (shape, f"{lines} lines")


def rerun(path):
    """The same MCAP file, converted and queried by Rerun."""
    from rerun.server import Server

    with tempfile.TemporaryDirectory() as folder:
        recording = f"{folder}/taxels.rrd"
        subprocess.run(["rerun", "mcap", "convert", path, "-o", recording], check=True, capture_output=True)
        with Server(datasets={"taxels": [recording]}) as server:
            data = server.client().get_dataset("taxels")
            names = data.schema().to_arrow().names
            assert any(name.startswith("/palpate_gripper/visual_geometries/object") for name in names)
            forces = data.filter_contents(["/palpate/taxels"]).reader(index="message_log_time").to_arrow_table()
    message = forces["/palpate/taxels:std_msgs.msg.Float32MultiArray:message"].to_pylist()
    message = [one[0] for one in message if one]
    shape = [axis["size"] for axis in message[0]["layout"]["dim"]]
    taxels = np.array([one["data"] for one in message]).reshape(-1, *shape)
    return taxels[..., 0].sum((2, 3), dtype=float), mcap(path)[1], shape


def main():
    for path in map(pathlib.Path, sys.argv[1:]):
        for reader in {".npz": [npz], ".parquet": [parquet], ".mcap": [mcap, rerun]}[path.suffix]:
            sums, forces, shape = reader(path)
            worst = np.abs(sums - forces).max()
            text = f"{path.name}, {reader.__name__}: {len(sums)} samples, {shape}, up to {forces.max():.3f} N"
            print(f"{text}, sums differ by {worst:.1e} N")
            assert worst < LIMIT and forces.max() > 0.1


main()
