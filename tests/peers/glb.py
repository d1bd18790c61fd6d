"""A grasp as a 3-D model, as other programs read it.

    npm install gltf-validator@2.0.0-dev.3.10
    pip install numpy==2.4.6 pygltflib==1.16.5 trimesh==5.2.0
    palpate grasp lemon && palpate movie 1 --out grasp.glb
    node tests/peers/glb.mjs grasp.glb        # Khronos' validator: no errors, no warnings
    python tests/peers/glb.py grasp.glb

pygltflib reads the file's parts; from them the pose of each joint at each time, the skin of the left finger at the last time, and
how far its tip is from the middle of that skin's end, which must stay below 1e-5 m. trimesh loads the whole scene. Nothing of
Palpate is used.
"""

import sys

import numpy as np
import pygltflib
import trimesh

SIZE = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
LIMIT = 1e-5  # m


def rotation(q):
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def main(path):
    file = pygltflib.GLTF2().load(path)
    blob = file.binary_blob()

    def read(number):
        accessor = file.accessors[number]
        view = file.bufferViews[accessor.bufferView]
        kind = {5126: "<f4", 5125: "<u4", 5121: "u1"}[accessor.componentType]
        count = accessor.count * SIZE[accessor.type]
        return np.frombuffer(blob, kind, count, view.byteOffset).reshape(accessor.count, -1)

    animation = file.animations[0]
    moved = {(c.target.node, c.target.path): animation.samplers[c.sampler] for c in animation.channels}
    names = {node.name: k for k, node in enumerate(file.nodes)}
    world = np.eye(4)
    world[:3, :3] = rotation(file.nodes[names["world"]].rotation)

    def pose(node, sample):
        own = np.eye(4)
        parts = {"rotation": file.nodes[node].rotation, "translation": file.nodes[node].translation}
        for name in parts:
            if (node, name) in moved:
                parts[name] = read(moved[node, name].output)[sample]
        own[:3, :3], own[:3, 3] = rotation(parts["rotation"]), parts["translation"]
        return world @ own

    finger = file.nodes[names["left finger"]]
    skin, part = file.skins[finger.skin], file.meshes[finger.mesh].primitives[0]
    bound = read(skin.inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
    corners, joints, weights = (read(getattr(part.attributes, n)) for n in ("POSITION", "JOINTS_0", "WEIGHTS_0"))
    last = len(read(moved[names["left tip"], "translation"].input)) - 1
    matrices = np.stack([pose(joint, last) @ inverse for joint, inverse in zip(skin.joints, bound)])
    placed = np.einsum("vj,vjab,vb->va", weights, matrices[joints], np.c_[corners, np.ones(len(corners))])[:, :3]
    tip = pose(names["left tip"], last)[:3, 3]
    at_tip = placed[(joints == len(skin.joints) - 1)[np.arange(len(joints)), weights.argmax(1)] & (weights.max(1) == 1)]
    # The middle of the end's width, on the neutral axis: the tip is in the plane of the end.
    normal = pose(names["left tip"], last)[:3, 2]
    off = np.abs((at_tip - tip) @ normal).max()
    print(f"{path}: {len(corners)} corners, {len(skin.joints)} joints, {last + 1} key frames, {len(part.targets)} shapes")
    print(f"end of the left finger {off:.1e} m from the plane of its tip, {len(at_tip)} corners there")
    assert off < LIMIT and len(at_tip) >= 9
    scene = trimesh.load(path, file_type="glb")
    print(f"trimesh: {sorted(scene.geometry)}, extents {np.round(scene.extents, 4)} m")
    assert {"palm", "left", "right"} <= set(scene.geometry) and 0.05 < scene.extents.max() < 1


main(sys.argv[1])
