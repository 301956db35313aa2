import torch

from surgisim.gaussians.adam import Adam, _advance_all


def test_all_tensors_at_once_step_as_each_alone():
    draw = torch.Generator().manual_seed(0)
    start = {"a": torch.randn(7, 3, generator=draw), "b": torch.randn(5, generator=draw)}
    rates = {"a": 1e-2, "b": 3e-3}
    alone = Adam(start, rates)
    values = [t.clone() for t in start.values()]
    first, second = ([torch.zeros_like(t) for t in values] for _ in range(2))
    for n in range(1, 4):
        slopes = [torch.randn(t.shape, generator=draw) for t in start.values()]
        alone.watch(start)
        for tensor, slope in zip(alone.tensors.values(), slopes, strict=True):
            tensor.grad = slope.clone()
        alone.advance(0.5)
        bias = (1 - 0.99**n) ** 0.5 / (1 - 0.9**n)
        _advance_all(values, first, second, slopes, [rate * 0.5 * bias for rate in rates.values()])
    for mine, other in zip(values, alone.tensors.values(), strict=True):
        torch.testing.assert_close(mine, other.detach(), rtol=1e-5, atol=1e-6)
