"""The same recording as somebody else might have made it: a frame, a millimetre or a per cent apart."""
