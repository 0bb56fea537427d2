#!/usr/bin/env python3
# /// script
# requires-python = ">=3.10"
# dependencies = ["numpy", "pillow", "scikit-image", "opencv-python-headless", "fast-slic"]
# ///
"""Sets temporal superpixels beside SLIC per frame, SLIC on the volume and fast-slic at the same number of labels.

    cargo build --release --example superpixels
    pip install numpy pillow scikit-image opencv-python-headless "cython<3" setuptools wheel
    pip install --no-build-isolation fast-slic          # optional: left out of the table where it is missing
    scripts/compare_superpixels.py CLIP N [LABELS...]   CLIP: a folder of PNG frames

LABELS are folders that examples/superpixels.rs wrote; without one the example is run at N. Peers get as many segments
as make them show about as many labels a frame as the first of these. One row of a Markdown table each:

labels       labels a frame, mean.
EV           explained variation of RGB (Xu and Corso, CVPR 2012): a label has one mean over its whole life.
EV frame     the same with a mean in each frame: what labels of single frames are good at.
duration     mean number of frames in which a label appears.
boundary     boundary pixels (another label at the right or below), moved by the optical flow to the next frame and
             rounded, that hit a boundary pixel there, minus what a random pixel would hit, over what is left to hit
             (as Cohen's kappa): 0 is chance, 1 perfect.
overlap      pixels moved by the flow that land in the segment in which most of their own segment lands: 1 minus the
             undersegmentation between successive frames. Needs no names, so it is fair to SLIC per frame.
same label   pixels moved by the flow that land in their own label.

Flow is OpenCV's DIS (medium), which none of the methods uses. Pixels whose flow fails a forward-backward check of one
pixel are left out of the last three.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np
from PIL import Image
from skimage.segmentation import slic

try:
    from fast_slic import Slic
except ImportError:
    Slic = None

# SLIC's own default (Achanta et al. 2012), and scikit-image's.
COMPACTNESS = 10


def read_frames(folder):
    return np.stack([np.asarray(Image.open(path).convert("RGB")) for path in sorted(Path(folder).glob("*.png"))])


def read_labels(folder, shape):
    planes = [np.fromfile(path, "<u4").reshape(shape[1:3]) for path in sorted(Path(folder).glob("*.labels"))]
    return np.stack(planes).astype(np.int64)


def run_ours(clip, count):
    root = Path(__file__).resolve().parent.parent
    with tempfile.TemporaryDirectory() as folder:
        files = sorted(str(path) for path in Path(clip).glob("*.png"))
        example = root / "target/release/examples/superpixels"
        report = subprocess.run([example, *files, folder, "--superpixels", str(count)], check=True, capture_output=True)
        print(report.stdout.decode().strip(), file=sys.stderr)
        return read_labels(folder, read_frames(clip).shape)


def distinct_per_frame(planes):
    """Labels of single frames as labels of the clip: none lives longer than a frame."""
    result, start = [], 0
    for plane in planes:
        _, dense = np.unique(plane, return_inverse=True)
        dense = dense.reshape(plane.shape)
        result.append(dense + start)
        start += dense.max() + 1
    return np.stack(result)


def slic_per_frame(frames, count):
    return distinct_per_frame([slic(f, n_segments=count, compactness=COMPACTNESS, start_label=0) for f in frames])


def slic_volume(frames, count):
    # Cubes: a segment's side in time is its side in the picture.
    side = (frames.shape[1] * frames.shape[2] / count) ** 0.5
    segments = int(frames[..., 0].size / side**3)
    return slic(frames, n_segments=segments, compactness=COMPACTNESS, channel_axis=-1, start_label=0)


def fast_slic_per_frame(frames, count):
    worker = Slic(num_components=count, compactness=COMPACTNESS)
    return distinct_per_frame([worker.iterate(np.ascontiguousarray(frame)).copy() for frame in frames])


def mean_labels(labels):
    return np.mean([len(np.unique(plane)) for plane in labels])


def explained_variation(frames, labels):
    """Scatter between the labels' means over the scatter of all."""
    colors = frames.reshape(-1, 3).astype(np.float64)
    colors -= colors.mean(axis=0)
    _, dense = np.unique(labels.reshape(-1), return_inverse=True)
    counts = np.bincount(dense)
    between = sum((np.bincount(dense, colors[:, c]) ** 2 / counts).sum() for c in range(3))
    return between / (colors**2).sum()


def duration(labels):
    planes = [np.unique(plane) for plane in labels]
    return sum(map(len, planes)) / len(np.unique(np.concatenate(planes)))


def boundary(plane):
    edge = np.zeros(plane.shape, bool)
    edge[:, :-1] |= plane[:, :-1] != plane[:, 1:]
    edge[:-1] |= plane[:-1] != plane[1:]
    return edge


def flows(frames):
    """For each frame but the last: rows and columns of the next that its pixels go to, and which of them are sure."""
    dis = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    gray = [cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY) for frame in frames]
    height, width = gray[0].shape
    rows, columns = np.mgrid[:height, :width]
    for a, b in zip(gray, gray[1:]):
        there, back = dis.calc(a, b, None), dis.calc(b, a, None)
        x, y = columns + there[..., 0], rows + there[..., 1]
        inside = (x >= 0) & (x <= width - 1) & (y >= 0) & (y <= height - 1)
        returned = cv2.remap(back, x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR)
        sure = inside & (np.abs(there + returned).max(axis=-1) < 1)
        yield np.clip(np.rint(y), 0, height - 1).astype(int), np.clip(np.rint(x), 0, width - 1).astype(int), sure


def stability(motion, labels):
    hits = chance = starts = overlap = same = pixels = 0
    for (rows, columns, sure), a, b in zip(motion, labels, labels[1:]):
        edge, next_edge = boundary(a) & sure, boundary(b)
        hits += next_edge[rows, columns][edge].sum()
        starts += edge.sum()
        chance += edge.sum() * next_edge.mean()
        here, there = a[sure], b[rows, columns][sure]
        same += (here == there).sum()
        pairs, counts = np.unique(np.stack([here, there]), axis=1, return_counts=True)
        overlap += np.maximum.reduceat(counts, np.flatnonzero(np.diff(pairs[0], prepend=-1))).sum()
        pixels += sure.sum()
    return (hits - chance) / (starts - chance), overlap / pixels, same / pixels


def row(name, frames, motion, labels, seconds):
    kappa, overlap, same = stability(motion, labels)
    per_frame = explained_variation(frames, distinct_per_frame(labels))
    whole = explained_variation(frames, labels)
    speed = f"{labels.size / seconds / 1e6:.2f}" if seconds else "-"
    print(
        f"| {name} | {mean_labels(labels):.0f} | {whole:.4f} | {per_frame:.4f} | {duration(labels):.1f} "
        f"| {kappa:.3f} | {overlap:.3f} | {same:.3f} | {speed} |",
        flush=True,
    )


def timed(method, frames, count):
    start = time.process_time()
    return method(frames, count), time.process_time() - start


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    clip, count = sys.argv[1], int(sys.argv[2])
    frames = read_frames(clip)
    motion = list(flows(frames))
    print("| method | labels | EV | EV frame | duration | boundary | overlap | same label | Mpixel/CPU s |")
    print("|---|---|---|---|---|---|---|---|---|")
    ours = [(Path(folder).name, read_labels(folder, frames.shape)) for folder in sys.argv[3:]]
    for name, labels in ours or [("temporal superpixels", run_ours(clip, count))]:
        row(name, frames, motion, labels, None)
        count = count if ours and name != ours[0][0] else round(mean_labels(labels))
    peers = [("SLIC a frame", slic_per_frame), ("SLIC on the volume", slic_volume)]
    if Slic is not None:
        peers.append(("fast-slic a frame", fast_slic_per_frame))
    for name, method in peers:
        # Segments asked for and labels shown differ: one correction brings them together.
        labels, seconds = timed(method, frames, count)
        asked = round(count * count / mean_labels(labels))
        if abs(asked - count) > 0.02 * count:
            labels, seconds = timed(method, frames, asked)
        row(name, frames, motion, labels, seconds)


if __name__ == "__main__":
    main()
