"""Tiny networks as ONNX files, written by hand: the package onnx is not needed to run one, only to make one.

Protocol buffers of onnx/onnx.proto: each field is its number and kind, then a number or a length and bytes.
"""

from pathlib import Path

import numpy as np

FLOAT, INTS = 1, 7


def write(path: Path, inputs: dict, nodes: list, outputs: dict, **constants: np.ndarray) -> Path:
    """inputs, outputs: name -> shape, of float32. nodes: (operator, inputs, output, whole-number attributes)."""
    graph = b"".join(_part(1, _node(*node)) for node in nodes) + _part(2, b"tiny")
    graph += b"".join(_part(5, _tensor(name, value)) for name, value in constants.items())
    for field, values in ((11, inputs), (12, outputs)):
        graph += b"".join(_part(field, _value(name, shape)) for name, shape in values.items())
    path.write_bytes(_number(1, 8) + _part(7, graph) + _part(8, _part(1, b"") + _number(2, 13)))
    return path


def _varint(value: int) -> bytes:
    out = b""
    while value > 127:
        out, value = out + bytes([value & 127 | 128]), value >> 7
    return out + bytes([value])


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3) + _varint(value)


def _part(field: int, content: bytes) -> bytes:
    return _varint(field << 3 | 2) + _varint(len(content)) + content


def _node(operator: str, inputs: list[str], output: str, attributes: dict[str, list[int]]) -> bytes:
    node = b"".join(_part(1, name.encode()) for name in inputs) + _part(2, output.encode())
    for name, numbers in attributes.items():
        told = _part(1, name.encode()) + b"".join(_number(8, n) for n in numbers) + _number(20, INTS)
        node += _part(5, told)
    return node + _part(4, operator.encode())


def _tensor(name: str, value: np.ndarray) -> bytes:
    sizes = b"".join(_number(1, n) for n in value.shape)
    return sizes + _number(2, FLOAT) + _part(8, name.encode()) + _part(9, value.astype("<f4").tobytes())


def _value(name: str, shape: tuple) -> bytes:
    sizes = (_number(1, n) if isinstance(n, int) else _part(2, n.encode()) for n in shape)
    dims = b"".join(_part(1, size) for size in sizes)
    return _part(1, name.encode()) + _part(2, _part(1, _number(1, FLOAT) + _part(2, dims)))
