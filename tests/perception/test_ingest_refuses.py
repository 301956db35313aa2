"""Bad input is refused in one sentence, and leaves nothing behind."""

import io
import pickle
import struct
import subprocess
import sys
import tarfile
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from recordings import H, W, endonerf, operated, pictures, png, silent, tissue, video, zipped

from surgisim.config.ingest import Ingest
from surgisim.perception.ingest.clip import ingest
from surgisim.problem import Problem

STAGE = Path(__file__).parents[2] / "stages/ingest.py"
THREE = np.stack([tissue(t) for t in range(3)])


def nothing_there(path):
    return path / "missing.mp4"


def empty_file(path):
    (path / "clip.mp4").write_bytes(b"")
    return path / "clip.mp4"


def text_named_video(path):
    (path / "clip.mp4").write_text("this is no video " * 100)
    return path / "clip.mp4"


def playlist(path):
    (path / "clip.mp4").write_text("#EXTM3U\n#EXTINF:1,\nhttp://example.invalid/a.ts\n#EXT-X-ENDLIST\n")
    return path / "clip.mp4"


def cut_video(path, suffix=".mp4", share=0.6):
    whole = video(path / f"whole{suffix}", operated(40)[0])
    cut = path / f"clip{suffix}"
    cut.write_bytes(whole.read_bytes()[: int(whole.stat().st_size * share)])
    return cut


def cut_matroska(path):
    return cut_video(path, ".mkv")


def cut_avi(path):
    return cut_video(path, ".avi")


def unknown_codec(path):
    whole = video(path / "whole.avi", operated()[0]).read_bytes()
    (path / "clip.avi").write_bytes(whole.replace(b"FMP4", b"ZZZZ").replace(b"fmp4", b"zzzz"))
    return path / "clip.avi"


def one_frame(path):
    return video(path / "clip.mp4", operated(1)[0])


def one_image(path):
    return pictures(path / "clip", THREE[:1])


def all_black(path):
    return video(path / "clip.mp4", np.zeros((8, H, W, 3), np.uint8))


def empty_folder(path):
    (path / "clip").mkdir()
    return path / "clip"


def recording_folder(path):
    folder = empty_folder(path)
    (folder / "recording.json").write_text('{"format": "surgisim-recording/1"}')
    return folder


def sixteen_bit_grey(path):
    folder = pictures(path / "clip", THREE)
    (folder / "frame1.png").write_bytes(png(tissue(0)[..., 0].astype(np.uint16) * 256))
    return folder


def sixteen_bit_colour(path):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    rows = b"".join(b"\0" + bytes(W * 6) for _ in range(H))
    head = struct.pack(">IIBBBBB", W, H, 16, 2, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    folder = pictures(path / "clip", THREE)
    (folder / "frame1.png").write_bytes(data)
    return folder


def alpha(path):
    return pictures(path / "clip", np.dstack([THREE[0], THREE[0][..., :1]])[None].repeat(3, 0))


def palette_with_transparency(path):
    folder = pictures(path / "clip", THREE)
    Image.fromarray(THREE[0]).quantize(16).save(folder / "frame1.png", transparency=3)
    return folder


def sizes_differ(path):
    folder = pictures(path / "clip", THREE)
    (folder / "frame2.png").write_bytes(png(tissue(2, (H, W + 2))))
    return folder


def cut_image(path):
    folder = pictures(path / "clip", THREE)
    (folder / "frame1.png").write_bytes(png(THREE[1])[:2000])
    return folder


def cut_jpeg(path):
    folder = pictures(path / "clip", THREE[:0])
    stream = io.BytesIO()
    Image.fromarray(THREE[0]).save(stream, "JPEG")
    for t in range(3):
        (folder / f"{t}.jpg").write_bytes(stream.getvalue()[: -400 if t == 1 else None])
    return folder


def claiming(data, side):
    """A PNG whose header says that it is `side` pixels wide and high."""
    data = bytearray(data)
    data[16:24] = struct.pack(">II", side, side)
    data[29:33] = struct.pack(">I", zlib.crc32(bytes(data[12:29])))
    return bytes(data)


def image_that_claims_too_much(path, side=60_000):
    folder = pictures(path / "clip", THREE)
    (folder / "frame1.png").write_bytes(claiming(png(THREE[1]), side))
    return folder


def image_that_claims_somewhat_too_much(path):
    # Below the number of pixels at which Pillow refuses by itself.
    return image_that_claims_too_much(path, 12_000)


def image_in_a_zip_that_claims_too_much(path):
    return zipped(path / "clip.zip", {f"images/{t}.png": claiming(png(THREE[t]), 60_000) for t in range(3)})


def mask_that_claims_too_much(path):
    folder = endonerf(path / "clip")[0]
    mask = folder / "gt_masks/frame8.png"
    mask.write_bytes(claiming(mask.read_bytes(), 60_000))
    return folder


def depth_that_claims_too_much(path):
    folder = endonerf(path / "clip")[0]
    depth = sorted((folder / "depth").iterdir())[0]
    depth.write_bytes(claiming(depth.read_bytes(), 60_000))
    return folder


def masks_of_another_size(path):
    folder = endonerf(path / "clip")[0]
    pictures(folder / "gt_masks", np.zeros((9, H - 2, W), np.uint8))
    return folder


def masks_of_another_count(path):
    folder = endonerf(path / "clip")[0]
    (folder / "gt_masks/frame8.png").unlink()
    return folder


def depth_in_colour(path):
    folder = endonerf(path / "clip")[0]
    pictures(folder / "depth", THREE[:1].repeat(9, 0))
    return folder


class Bomb:
    def __reduce__(self):
        return (sys.exit, ("unpickled",))


def pickled_poses(path):
    folder = endonerf(path / "clip")[0]
    np.save(folder / "poses_bounds.npy", np.array([Bomb()], object), allow_pickle=True)
    return folder


def bare_pickle(path):
    folder = endonerf(path / "clip")[0]
    (folder / "poses_bounds.npy").write_bytes(pickle.dumps(Bomb()))
    return folder


def poses_that_claim_too_much(path):
    folder = endonerf(path / "clip")[0]
    with open(folder / "poses_bounds.npy", "wb") as stream:
        np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": (10**15, 17)})
        stream.write(bytes(17 * 8))
    return folder


def poses_of_another_clip(path):
    folder = endonerf(path / "clip")[0]
    np.save(folder / "poses_bounds.npy", np.load(folder / "poses_bounds.npy") * 2)
    return folder


def climbing_zip(path):
    return zipped(path / "clip.zip", {"images/0.png": png(THREE[0]), "images/../../evil.png": png(THREE[1])})


def climbing_zip_backwards(path):
    return zipped(path / "clip.zip", {"images/0.png": png(THREE[0]), "..\\evil.png": png(THREE[1])})


def absolute_zip(path):
    return zipped(path / "clip.zip", {"images/0.png": png(THREE[0]), "/evil.png": png(THREE[1])})


def linking_zip(path):
    link = zipfile.ZipInfo("images/1.png")
    link.external_attr = 0o120777 << 16
    with zipfile.ZipFile(path / "clip.zip", "w") as archive:
        archive.writestr("images/0.png", png(THREE[0]))
        archive.writestr(link, "/etc/passwd")
    return path / "clip.zip"


def linking_tar(path, name="clip.tar"):
    link = tarfile.TarInfo("images/1.png")
    link.type, link.linkname = tarfile.SYMTYPE, "/etc/passwd"
    with tarfile.open(path / name, "w:gz" if name.endswith("gz") else "w") as archive:
        archive.addfile(link)
        archive.addfile(tarfile.TarInfo("../evil.png"))
    return path / name


def packed_tar(path):
    return linking_tar(path, "clip.tar.gz")


def zip_in_a_folder_that_climbs(path):
    folder = empty_folder(path)
    climbing_zip(folder)
    return folder


def zip_bomb(path):
    return zipped(path / "clip.zip", {f"images/{t}.png": bytes(200_000_000) for t in range(2)})


def broken_zip(path):
    whole = zipped(path / "whole.zip", {"images/0.png": png(THREE[0])}).read_bytes()
    (path / "clip.zip").write_bytes(whole[:-30])
    return path / "clip.zip"


def damaged_zip_member(path):
    whole = bytearray(zipped(path / "whole.zip", {f"images/{t}.png": png(THREE[t]) for t in range(3)}).read_bytes())
    whole[3000:3100] = bytes(100)
    (path / "clip.zip").write_bytes(bytes(whole))
    return path / "clip.zip"


BAD = {
    nothing_there: "no such file",
    empty_file: "is empty",
    text_named_video: "is not a video",
    playlist: "is not a video",
    cut_video: "is not a video",
    cut_matroska: "cut short",
    cut_avi: "cut short",
    unknown_codec: "codec cannot be decoded",
    one_frame: "1 frame ",
    one_image: "1 frame ",
    all_black: "every frame is black",
    empty_folder: "no PNG or JPEG",
    recording_folder: "`diagnose`",
    sixteen_bit_grey: "16 bits",
    sixteen_bit_colour: "16 bits",
    alpha: "alpha",
    palette_with_transparency: "alpha",
    sizes_differ: "differ in size",
    cut_image: "cut short",
    cut_jpeg: "cut short",
    image_that_claims_too_much: "claims",
    image_that_claims_somewhat_too_much: "claims",
    image_in_a_zip_that_claims_too_much: "claims",
    mask_that_claims_too_much: "claims",
    depth_that_claims_too_much: "claims",
    masks_of_another_size: "but the frames are",
    masks_of_another_count: "holds 8 images",
    depth_in_colour: "one grey channel",
    pickled_poses: "pickled",
    bare_pickle: "pickled",
    poses_that_claim_too_much: "not a plain array",
    poses_of_another_clip: "Pass the poses of these frames",
    climbing_zip: "points out of the archive",
    climbing_zip_backwards: "points out of the archive",
    absolute_zip: "points out of the archive",
    linking_zip: "is a link",
    zip_in_a_folder_that_climbs: "points out of the archive",
    linking_tar: "is not a video",
    packed_tar: "is not a video",
    zip_bomb: "is not a PNG",
    broken_zip: "cannot be read as a zip",
    damaged_zip_member: "damaged",
}


@pytest.mark.parametrize("make", BAD, ids=lambda make: make.__name__)
def test_bad_input_is_refused_in_one_sentence(tmp_path, make):
    with pytest.raises(Problem) as refused:
        ingest(make(tmp_path), Ingest(), progress=silent)
    assert BAD[make] in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_bomb_is_refused_by_its_headers(tmp_path):
    with pytest.raises(Problem, match="unpacks to"):
        ingest(zip_bomb(tmp_path), Ingest(max_unpacked=100_000_000), progress=silent)


def test_a_crop_outside_the_picture_is_refused(tmp_path):
    with pytest.raises(Problem, match=r"ingest.crop"):
        ingest(pictures(tmp_path / "clip", THREE), Ingest(crop=(0, 0, W + 1, H)), progress=silent)


def test_asking_for_masks_that_did_not_come_is_refused(tmp_path):
    with pytest.raises(Problem, match="gt_masks"):
        ingest(pictures(tmp_path / "clip", THREE), Ingest(given_masks="gt_masks"), progress=silent)


@pytest.mark.parametrize("make", [cut_avi, sixteen_bit_colour])
def test_the_stage_leaves_with_an_error_and_no_file(tmp_path, make):
    outputs = {name: tmp_path / "out" / name for name in ("frames.npz", "camera.json", "given.npz")}
    flags = [f"--{name.split('.')[0]}={path}" for name, path in outputs.items()]
    done = subprocess.run(
        [sys.executable, STAGE, f"--clip={make(tmp_path)}", *flags], capture_output=True, text=True, check=False
    )
    assert done.returncode != 0
    assert "error: " in done.stderr
    assert "Traceback" not in done.stderr
    assert not any(path.exists() for path in outputs.values())
