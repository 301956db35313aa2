"""Bodies of masses and springs that the method is held against. A baseline is one file here with a function `network`;
its file name is its name.

network(body, modulus) -> Network, see `springs`
"""
