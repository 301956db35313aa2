"""Memory that a stream keeps for its next arrays."""

from surgisim.mpm.stream import Reused


class Source:
    """Addresses, and what became of them."""

    def __init__(self):
        self.given, self.returned = {}, {}

    def allocate(self, size):
        self.given[len(self.given)] = size
        return len(self.given) - 1

    def deallocate(self, address, size):
        self.returned[address] = size


def test_a_block_serves_again_where_it_is_large_enough_and_goes_back_in_the_end():
    source = Source()
    memory = Reused(source)
    large, small = memory.allocate(1000), memory.allocate(40)
    assert source.given == {large: 1024, small: 64}
    memory.deallocate(large, 1000)
    memory.deallocate(small, 40)
    assert not source.returned
    assert memory.allocate(513) == large
    assert memory.allocate(33) == small
    assert memory.allocate(32) not in (large, small)
    memory.deallocate(large, 513)
    del memory
    assert source.returned == {large: 1024}
