"""Optical flow by RAFT, with weights from a file.

Teed and Deng, RAFT: Recurrent all-pairs field transforms for optical flow, ECCV 2020 (the full model). Features of both
frames at an eighth of their size, the product of every pair of them at four scales, and a recurrent unit that looks up
the products around where it is and moves on.
"""

from pathlib import Path

import cv2
import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.torch import load_file
from torch import Tensor, nn
from torch.nn import functional

from surgisim.perception.optical_flow import Flow
from surgisim.problem import Problem

EIGHTH = 8
"""Pixels to a side of one place where features are."""
LEVELS, RADIUS = 4, 4
STEPS = 12
"""Rounds of the recurrent unit, as in its training. 20 and 32 told a shift of 5 px to the same .03 px."""
WIDE, LARGER = 640, 2.0
"""Longest side to which smaller frames are enlarged [px], and how much at most. It was trained on pictures of 768 and
1024; on EndoNeRF pulling at 320 px the forward-backward error over five frames is .36 px enlarged and .46 as it is."""
LEAST = 128
"""Shortest side at which the coarsest scale still has places to compare [px]."""
HIDDEN = 128


def prepared(weights: Path | None) -> Flow:
    """Flow by the network of a safetensors file. Raises Problem where there is none, or another one's."""
    network = _loaded(weights)

    def flow(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        height, width = a.shape[:2]
        by = max(min(WIDE / max(height, width), LARGER), LEAST / min(height, width), 1.0)
        with torch.inference_mode():
            found = network(*(_fitted(frame, by) for frame in (a, b)))[0].permute(1, 2, 0).numpy()
        # What was added below and to the right is left out.
        found = found[: round(height * by), : round(width * by)]
        scale = np.array([width / found.shape[1], height / found.shape[0]], np.float32)
        return cv2.resize(found, (width, height), interpolation=cv2.INTER_AREA) * scale

    return flow


def _fitted(frame: np.ndarray, by: float) -> Tensor:
    """The frame enlarged, its sides multiples of 8, from -1 to 1, (1, 3, H, W)."""
    colour = frame if frame.ndim == 3 else np.repeat(frame[..., None], 3, -1)
    height, width = round(frame.shape[0] * by), round(frame.shape[1] * by)
    if by > 1:
        colour = cv2.resize(colour, (width, height), interpolation=cv2.INTER_CUBIC)
    colour = cv2.copyMakeBorder(colour, 0, -height % EIGHTH, 0, -width % EIGHTH, cv2.BORDER_REPLICATE)
    return torch.from_numpy(colour.astype(np.float32) / 127.5 - 1).permute(2, 0, 1)[None]


def _loaded(path: Path | None) -> "Raft":
    if path is None or not path.is_file():
        raise Problem(
            f"flow 'raft' needs its weights as a safetensors file (flow_weights), and "
            f"{'none is named' if path is None else f'{path} is not there'}. They are published as princeton-vl/RAFT "
            "(raft-sintel.pth, to be saved as safetensors); meanwhile use flow: dis, which needs no weights."
        )
    network = Raft()
    try:
        held = load_file(path)
    except (SafetensorError, OSError) as error:
        raise Problem(
            f"{path}: cannot be read as a safetensors file ({error}). Save RAFT's weights as one, or use flow: dis."
        ) from error
    wanted = {name: tuple(tensor.shape) for name, tensor in network.state_dict().items() if "num_batches" not in name}
    found = {name: tuple(tensor.shape) for name, tensor in held.items() if "num_batches" not in name}
    if wrong := sorted(name for name in wanted.keys() | found.keys() if wanted.get(name) != found.get(name)):
        raise Problem(
            f"{path}: holds another network than RAFT's full one: {wrong[0]} is {found.get(wrong[0], 'not there')}, "
            f"{wanted.get(wrong[0], 'nothing')} is wanted ({len(wrong)} of {len(wanted)} differ). Name RAFT's weights, "
            "or use flow: dis."
        )
    network.load_state_dict({name: held[name].float() for name in wanted}, strict=False)
    if not all(tensor.isfinite().all() for tensor in network.state_dict().values()):
        raise Problem(f"{path}: holds values that are no numbers. Fetch RAFT's weights again, or use flow: dis.")
    return network.eval()


class Residual(nn.Module):
    def __init__(self, before: int, after: int, stride: int, norm) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(before, after, 3, stride, 1)
        self.conv2 = nn.Conv2d(after, after, 3, 1, 1)
        self.norm1, self.norm2 = norm(after), norm(after)
        self.downsample = None
        if stride > 1:
            self.norm3 = norm(after)
            # The same normalisation by two names, as the published files hold it.
            self.downsample = nn.Sequential(nn.Conv2d(before, after, 1, stride), self.norm3)

    def forward(self, x: Tensor) -> Tensor:
        y = functional.relu(self.norm1(self.conv1(x)))
        y = functional.relu(self.norm2(self.conv2(y)))
        return functional.relu(y + (x if self.downsample is None else self.downsample(x)))


class Encoder(nn.Module):
    """Features at an eighth of the frame's size, (N, 256, H / 8, W / 8)."""

    def __init__(self, norm) -> None:
        super().__init__()
        self.conv1, self.norm1 = nn.Conv2d(3, 64, 7, 2, 3), norm(64)
        self.layer1 = nn.Sequential(Residual(64, 64, 1, norm), Residual(64, 64, 1, norm))
        self.layer2 = nn.Sequential(Residual(64, 96, 2, norm), Residual(96, 96, 1, norm))
        self.layer3 = nn.Sequential(Residual(96, 128, 2, norm), Residual(128, 128, 1, norm))
        self.conv2 = nn.Conv2d(128, 256, 1)

    def forward(self, x: Tensor) -> Tensor:
        x = functional.relu(self.norm1(self.conv1(x)))
        return self.conv2(self.layer3(self.layer2(self.layer1(x))))


class Motion(nn.Module):
    """What the products around, and the flow so far, say."""

    def __init__(self) -> None:
        super().__init__()
        self.convc1 = nn.Conv2d(LEVELS * (2 * RADIUS + 1) ** 2, 256, 1)
        self.convc2 = nn.Conv2d(256, 192, 3, padding=1)
        self.convf1 = nn.Conv2d(2, 128, 7, padding=3)
        self.convf2 = nn.Conv2d(128, 64, 3, padding=1)
        self.conv = nn.Conv2d(256, HIDDEN - 2, 3, padding=1)

    def forward(self, flow: Tensor, products: Tensor) -> Tensor:
        products = functional.relu(self.convc2(functional.relu(self.convc1(products))))
        moved = functional.relu(self.convf2(functional.relu(self.convf1(flow))))
        both = functional.relu(self.conv(torch.cat([products, moved], 1)))
        return torch.cat([both, flow], 1)


class Memory(nn.Module):
    """A gated recurrent unit along rows, then along columns."""

    def __init__(self) -> None:
        super().__init__()
        for number, size in ((1, (1, 5)), (2, (5, 1))):
            for gate in "zrq":
                padding = (size[0] // 2, size[1] // 2)
                self.add_module(f"conv{gate}{number}", nn.Conv2d(3 * HIDDEN, HIDDEN, size, padding=padding))

    def forward(self, state: Tensor, told: Tensor) -> Tensor:
        for z, r, q in ((self.convz1, self.convr1, self.convq1), (self.convz2, self.convr2, self.convq2)):
            both = torch.cat([state, told], 1)
            new = torch.tanh(q(torch.cat([torch.sigmoid(r(both)) * state, told], 1)))
            share = torch.sigmoid(z(both))
            state = (1 - share) * state + share * new
        return state


class Head(nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.conv1, self.conv2 = nn.Conv2d(HIDDEN, 256, 3, padding=1), nn.Conv2d(256, 2, 3, padding=1)

    def forward(self, state: Tensor) -> Tensor:
        return self.conv2(functional.relu(self.conv1(state)))


class Update(nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.encoder, self.gru, self.flow_head = Motion(), Memory(), Head()
        self.mask = nn.Sequential(
            nn.Conv2d(HIDDEN, 256, 3, padding=1), nn.ReLU(), nn.Conv2d(256, 9 * EIGHTH * EIGHTH, 1)
        )


class Raft(nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.fnet, self.cnet = Encoder(nn.InstanceNorm2d), Encoder(nn.BatchNorm2d)
        self.update_block = Update()

    def forward(self, a: Tensor, b: Tensor, steps: int = STEPS) -> Tensor:
        """Flow [px], (1, 2, H, W), of frames (1, 3, H, W) from -1 to 1 whose sides are multiples of 8."""
        one, other = self.fnet(torch.cat([a, b])).split(1)
        pyramid = _products(one[0], other[0])
        state, context = self.cnet(a).split(HIDDEN, 1)
        state, context = torch.tanh(state), functional.relu(context)
        height, width = one.shape[2:]
        y, x = torch.meshgrid(torch.arange(height), torch.arange(width), indexing="ij")
        here = torch.stack([x, y]).float()[None].to(a)
        flow = torch.zeros_like(here)
        for _ in range(steps):
            told = self.update_block.encoder(flow, _looked_up(pyramid, here + flow))
            state = self.update_block.gru(state, torch.cat([context, told], 1))
            flow = flow + self.update_block.flow_head(state)
        return _enlarged(flow, 0.25 * self.update_block.mask(state))


def _products(one: Tensor, other: Tensor) -> list[Tensor]:
    """Products of all pairs of places at each scale, (H W, 1, H', W')."""
    channels, height, width = one.shape
    all_pairs = one.flatten(1).T @ other.flatten(1) / channels**0.5
    pyramid = [all_pairs.reshape(height * width, 1, height, width)]
    for _ in range(LEVELS - 1):
        pyramid.append(functional.avg_pool2d(pyramid[-1], 2))
    return pyramid


def _looked_up(pyramid: list[Tensor], at: Tensor) -> Tensor:
    """Products around the places `at` (1, 2, H, W), nothing outside of the frame, (1, 4 * 81, H, W)."""
    height, width = at.shape[2:]
    reach = torch.arange(-RADIUS, RADIUS + 1).to(at)
    # Columns first: in this order the published weights were trained.
    around = torch.stack(torch.meshgrid(reach, reach, indexing="ij"), -1)
    center = at[0].permute(1, 2, 0).reshape(-1, 1, 1, 2)
    found = []
    for level, products in enumerate(pyramid):
        size = torch.tensor([products.shape[3] - 1, products.shape[2] - 1]).to(at)
        place = 2 * (center / 2**level + around) / size - 1
        found.append(functional.grid_sample(products, place, align_corners=True).reshape(height, width, -1))
    return torch.cat(found, -1).permute(2, 0, 1)[None]


def _enlarged(flow: Tensor, weights: Tensor) -> Tensor:
    """Flow at full size: each pixel a weighted mean of the nine places around it, (1, 2, H, W)."""
    height, width = flow.shape[2:]
    share = weights.reshape(1, 9, EIGHTH, EIGHTH, height, width).softmax(1)
    nine = functional.unfold(EIGHTH * flow, 3, padding=1).reshape(2, 9, 1, 1, height, width)
    return (share * nine).sum(1).permute(0, 3, 1, 4, 2).reshape(1, 2, EIGHTH * height, EIGHTH * width)
