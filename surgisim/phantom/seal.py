"""An answer that is fixed before anybody looks for it, and shown afterwards.

The seal is sha256(truth + salt) in hexadecimal, of the bytes of truth.json followed by those of the salt. It tells
nothing of the truth while the salt is secret, and no other truth has it.
"""

import hashlib
import hmac
import secrets

from surgisim.problem import Problem


def salt() -> str:
    """64 hexadecimal digits that nobody can guess."""
    return secrets.token_hex(32)


def seal(truth: bytes, salt: str) -> str:
    """64 hexadecimal digits."""
    return hashlib.sha256(truth + salt.encode()).hexdigest()


def verify(truth: bytes, salt: str, sealed: str) -> None:
    """Raises Problem if this truth is not the one that was sealed."""
    if not hmac.compare_digest(seal(truth, salt), sealed.strip()):
        raise Problem(
            "truth.json does not have the seal that was published before the diagnosis: it, its salt or the seal was "
            "changed. Nothing can be scored against it; invent the case anew with another seed."
        )
