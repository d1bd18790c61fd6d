"""A data set that Palpate wrote for LeRobot, opened by LeRobot, with its statistics computed anew.

    pip install lerobot==0.4.4
    palpate trials export 1 2 --taxels --as lerobot --out grasps/
    HF_HUB_OFFLINE=1 python tests/peers/lerobot_set.py grasps/

Quantiles, which LeRobot estimates from histograms, are those of numpy; as in LeRobot, their means over episodes stand in
the statistics of the data set. Nothing of Palpate is used.
"""

import sys

import numpy as np
import torch
from lerobot.datasets.compute_stats import aggregate_stats, compute_episode_stats
from lerobot.datasets.lerobot_dataset import LeRobotDataset

QUANTILES = [1, 10, 50, 90, 99]


def main(root):
    data = LeRobotDataset("palpate/grasps", root=root, delta_timestamps={"observation.tactile": [0.0]})
    print(data)
    batch = next(iter(torch.utils.data.DataLoader(data, batch_size=8, shuffle=True)))
    print({name: tuple(value.shape) for name, value in batch.items() if hasattr(value, "shape")}, set(batch["task"]))
    frames = data.hf_dataset.with_format("numpy")
    names = [name for name in data.features if not name.endswith("index")]
    episodes = []
    for episode in data.meta.episodes:
        rows = slice(episode["dataset_from_index"], episode["dataset_to_index"])
        columns = {name: np.stack(frames[name][rows]) for name in names}
        assert all(np.isfinite(column).all() for column in columns.values())
        if "observation.taxel_normal" in columns:
            tactile = data.features["observation.tactile"]["names"]
            forces = columns["observation.tactile"][:, [tactile.index(f"force_{side}") for side in ("left", "right")]]
            sums = columns["observation.taxel_normal"].reshape(len(forces), 2, -1).sum(2, dtype=float)
            print(f"episode {episode['episode_index']}: sums of taxels differ by {np.abs(sums - forces).max():.1e} N")
            assert np.abs(sums - forces).max() < 1e-5
        stats = compute_episode_stats(columns, data.features)
        for name, column in columns.items():
            stats[name] |= {f"q{q:02}": np.atleast_1d(np.quantile(column, q / 100, axis=0)) for q in QUANTILES}
        episodes.append(stats)
    worst = 0.0
    for name, rows in aggregate_stats(episodes).items():
        span = rows["max"] - rows["min"] + 1e-9
        for row in ["min", "max", "mean", "std", "q01", "q10", "q50", "q90", "q99"]:
            apart = np.max(np.abs(rows[row] - data.meta.stats[name][row]) / span)
            assert apart < 1e-5, (name, row, apart)
            worst = max(worst, apart)
        assert rows["count"] == data.meta.stats[name]["count"]
    print(f"statistics differ by {worst:.1e} of the range")


main(sys.argv[1])
