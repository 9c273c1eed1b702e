"""An image by the workers of a Dask cluster, here of this machine:

    python dask_farm.py scene.glb image.exr --spp 256

Give `Client` the address of a scheduler to use yours; all workers have to see the folder of the image. A worker that
dies is replaced, and its shard goes on from its checkpoint: the image is that of a single render, byte for byte.
"""

import sys
from pathlib import Path

from dask.distributed import Client, LocalCluster, as_completed

import pathspace as ps


def render(client: Client, scene: Path, image: Path, count: int, **options) -> None:
    """Renders ``count`` shards beside the image, and merges them."""
    shards = [image.with_suffix(f".{i}-of-{count}.exr") for i in range(1, count + 1)]
    tasks = [
        client.submit(ps.render_shard, scene, shard, i, count, pure=False, retries=3, **options)
        for i, shard in enumerate(shards, 1)
    ]
    for done, task in enumerate(as_completed(tasks), 1):
        task.result()
        print(f"{done} of {count} shards", flush=True)
    ps.merge(shards, image)
    for shard in shards:
        shard.unlink()  # else another render of this name would take them for its own


if __name__ == "__main__":
    scene, image, *words = sys.argv[1:]
    spp = int(words[words.index("--spp") + 1]) if words else 64
    with LocalCluster(threads_per_worker=1) as cluster, Client(cluster) as client:
        render(client, Path(scene).resolve(), Path(image).resolve(), 2 * len(cluster.workers), spp=spp, threads=1)
