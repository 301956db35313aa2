"""What a path holds: a video, a folder of images, or an EndoNeRF layout, told apart here and nowhere else."""

import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from surgisim.perception.ingest import picture, video
from surgisim.perception.ingest.archive import Tree, is_film, tree
from surgisim.problem import Problem

ASSUMED_FPS = 25.0
"""For a folder of images, which says nothing [1/s]."""
Read = Callable[[int], np.ndarray]


@dataclass(frozen=True)
class Recording:
    """What a path holds, at its own size; images are decoded when asked for."""

    where: Path
    frames: Callable[[], Iterator[np.ndarray]]
    """Every frame in turn, sRGB, (H, W, 3) uint8."""
    fps: float
    """[1/s]"""
    focal: float | None = None
    """As it came with the recording [px]."""
    tool: Read | None = None
    """Mask of a frame, (H, W) uint8."""
    depth: Read | None = None
    """Depth of a frame in steps, 0 where unknown, (H, W) uint16."""
    right: Read | None = None
    """Right view of a frame, sRGB, (H, W, 3) uint8."""


def recognise(path: Path, *, max_pixels: int, max_unpacked: int, given_masks: str) -> Recording:
    """The recording at `path`, or one sentence saying what was found instead."""
    if not path.exists():
        raise Problem(f"{path}: no such file or folder. Pass a video, an image folder or an EndoNeRF folder or zip.")
    if is_film(path):
        if path.stat().st_size == 0:
            raise Problem(f"{path}: is empty. Copy the video again.")
        film = video.opened(path, max_pixels=max_pixels)
        return Recording(path, film.frames, film.fps)
    if (path / "recording.json").is_file():
        raise Problem(
            f"{path}: is a recording folder (recording.json), which is for `diagnose`; ingest wants a video, an image "
            "folder or an EndoNeRF folder."
        )
    files = tree(path, max_unpacked=max_unpacked)
    pictures = {f: names for f in files.folders() if (names := _pictures(files, f))}
    if not pictures:
        raise Problem(f"{path}: holds no PNG or JPEG images. Pass a video, an image folder or an EndoNeRF folder.")
    left = _left(path, pictures)
    return _layout(files, pictures, left, max_pixels=max_pixels, given_masks=given_masks)


def _pictures(files: Tree, folder: str) -> list[str]:
    return [n for n in files.inside(folder) if n.lower().endswith(picture.SUFFIXES)]


def _left(path: Path, pictures: dict[str, list[str]]) -> str:
    """The folder that holds the recording's own frames."""
    named = [f for f in pictures if PurePosixPath(f).name in ("images", "image", "rgb", "frames", "images_left")]
    named = named or [f for f in pictures if PurePosixPath(f).name.startswith(("images_left", "left"))]
    if len(named) == 1:
        return named[0]
    if not named and len(pictures) == 1:
        return next(iter(pictures))
    if not named and "" in pictures:
        return ""
    raise Problem(
        f"{path}: holds images in {sorted(pictures)}, and it is not clear which are the frames. "
        "Name that folder 'images'."
    )


def _layout(files: Tree, pictures, left: str, *, max_pixels: int, given_masks: str) -> Recording:
    frames = pictures[left]
    beside = "" if left == "" else str(PurePosixPath(left).parent).removeprefix(".")
    sizes = {picture.size(files.read(n), f"{files.where}: {n}", max_pixels=max_pixels): n for n in frames}
    if len(sizes) > 1:
        (a, first), (b, second) = list(sizes.items())[:2]
        raise Problem(
            f"{files.where}: frames differ in size; {first} is {a[1]} x {a[0]} px and {second} {b[1]} x {b[0]}. "
            "Pass frames of one size."
        )
    (size,) = sizes

    def companion(names: tuple[str, ...], read) -> Read | None:
        for name in names:
            folder = f"{beside}/{name}".lstrip("/")
            if left and folder in pictures:
                return _checked(files, pictures[folder], folder, len(frames), size, read, max_pixels)
        return None

    masks = {"auto": ("gt_masks", "masks"), "gt_masks": ("gt_masks",), "masks": ("masks",), "none": ()}[given_masks]
    tool = companion(masks, picture.grey)
    if tool is None and given_masks in ("gt_masks", "masks"):
        raise Problem(f"{files.where}: has no folder '{given_masks}', which ingest.given_masks asks for.")
    return Recording(
        files.where,
        lambda: (picture.colour(files.read(n), f"{files.where}: {n}", max_pixels=max_pixels) for n in frames),
        ASSUMED_FPS,
        focal=_focal(files, f"{beside}/poses_bounds.npy".lstrip("/"), size) if left else None,
        tool=tool,
        depth=companion(("depth", "depths"), picture.depth),
        right=companion(("images_right", "right", *_rights(pictures, beside)), picture.colour),
    )


def _rights(pictures: dict[str, list[str]], beside: str) -> list[str]:
    folders = [PurePosixPath(f) for f in pictures]
    return [p.name for p in folders if str(p.parent).removeprefix(".") == beside and p.name.startswith("images_right")]


def _checked(files: Tree, names: list[str], folder: str, count: int, size, read, max_pixels: int) -> Read:
    if len(names) != count:
        raise Problem(
            f"{files.where}: {folder} holds {len(names)} images, but there are {count} frames. Pass one each."
        )

    def at(index: int) -> np.ndarray:
        where = f"{files.where}: {names[index]}"
        values = read(files.read(names[index]), where, max_pixels=max_pixels)
        if values.shape[:2] != size:
            h, w = values.shape[:2]
            raise Problem(f"{where} is {w} x {h} px, but the frames are {size[1]} x {size[0]}. Pass one size.")
        return values

    return at


def _focal(files: Tree, name: str, size: tuple[int, int]) -> float | None:
    """Focal length of an LLFF poses file: rows of a 3 x 5 matrix (last column height, width, focal) and bounds."""
    if name not in files.files:
        return None
    where = f"{files.where}: {name}"
    try:
        poses = np.load(io.BytesIO(files.read(name)), allow_pickle=False)
    except (ValueError, EOFError, OSError, MemoryError) as error:
        raise Problem(
            f"{where}: is not a plain array of numbers (pickled files are never opened). Save it with numpy.save."
        ) from error
    if not isinstance(poses, np.ndarray) or poses.ndim != 2 or poses.shape[1] != 17 or poses.dtype.kind not in "fiu":
        raise Problem(f"{where}: an LLFF file of shape (frames, 17) is wanted. Take it away to have the focal assumed.")
    height, width, focal = poses[0, [4, 9, 14]]
    if (round(height), round(width)) != size or not focal > 0:
        raise Problem(
            f"{where}: is for {width:.0f} x {height:.0f} px with focal {focal:.1f}, but the frames are "
            f"{size[1]} x {size[0]}. Pass the poses of these frames."
        )
    return float(focal)
