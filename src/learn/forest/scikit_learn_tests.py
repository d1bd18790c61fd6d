"""Prints the numbers that scikit_learn_tests.rs compares with; needs scikit-learn 1.9.1."""

import numpy as np
from sklearn.ensemble import (
    BaggingClassifier,
    ExtraTreesClassifier,
    GradientBoostingClassifier,
    RandomForestClassifier,
)
from sklearn.metrics import recall_score
from sklearn.tree import DecisionTreeClassifier

M = 2**64 - 1


def hash64(x):
    x = (x + 0x9E3779B97F4A7C15) & M
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & M
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & M
    return x ^ (x >> 31)


def data(rows):
    of_20 = [0] * 6 + [1] * 5 + [2] * 4 + [3] * 3 + [4, 5]
    x, y = [], []
    for row in rows:
        label = of_20[row % 20]
        cluster = 2 * label + (hash64(row) & 1)
        y.append(label)
        centre = [hash64(1_000_000 + 100 * cluster + c) % 5 * 100 if c < 8 else 0 for c in range(10)]
        noise = [sum(hash64(2_000_000 + 100 * row + c).to_bytes(8, "little")[:4]) for c in range(10)]
        x.append([(a + b) // 8 for a, b in zip(centre, noise)])
    return np.array(x, np.float32), np.array(y)


def fingerprint(labels):
    """FNV-1a of the predicted classes."""
    h = 0xCBF29CE484222325
    for label in labels:
        h = ((h ^ int(label)) * 0x100000001B3) & M
    return f"{h:#018x}"


x, y = data(range(360))
tx, ty = data(range(360, 2360))
# Irregular, or many columns would split a node equally well.
weights = np.array([512.0 + hash64(row) % 1024 for row in range(len(y))])


def recall(model):
    return recall_score(ty, model.predict(tx), average="macro")


def exact(name, make, x=x, tx=tx, **fit):
    """Trees whose answer depends on the seed would depend on ties between columns."""
    fitted = [make(seed).fit(x, y, **fit) for seed in range(10)]
    prints = {fingerprint(model.predict(tx)) for model in fitted}
    print(name, prints, f"{(fitted[0].predict(tx) == ty).mean():.4f}")
    return fitted[0]


def banded(name, make):
    recalls = [recall(make(seed).fit(x, y)) for seed in range(20)]
    print(f"{name}: {np.mean(recalls):.4f}, deviation between seeds {np.std(recalls):.4f}")


tree = DecisionTreeClassifier
exact("one column", lambda s: tree(random_state=s), x[:, :1], tx[:, :1])
exact("three levels", lambda s: tree(max_depth=3, min_samples_leaf=5, random_state=s))
exact("weighted, leaves of 5", lambda s: tree(min_samples_leaf=5, random_state=s), sample_weight=weights)
gbc = lambda s: GradientBoostingClassifier(n_estimators=20, min_samples_leaf=10, random_state=s)
model = exact("gradient boosting", gbc, sample_weight=weights)
print("  probabilities of the first test row", model.predict_proba(tx[:1]).round(9).tolist())

banded("decision tree", lambda s: tree(random_state=s))
banded("random forest", lambda s: RandomForestClassifier(100, random_state=s))
banded("extra-trees", lambda s: ExtraTreesClassifier(100, random_state=s))
banded("bagged trees", lambda s: BaggingClassifier(n_estimators=50, random_state=s))
banded("gradient boosting", lambda s: GradientBoostingClassifier(n_estimators=50, subsample=0.5, random_state=s))
