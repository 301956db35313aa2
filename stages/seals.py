"""Write all seals of a run into one file, which every diagnosis waits for.

reads   every case's seal.txt
writes  seals.txt    one line a case: its number and its seal
"""

from surgisim.config.base import Settings
from surgisim.stage import Bytes, Several, Source, stage


@stage(reads={"seal": Several(Source("a case's seal.txt"))}, writes={"seals": Bytes(".txt")}, settings=Settings)
def main(seal, *, settings, progress):
    return "".join(f"{path.parent.name} {path.read_text().strip()}\n" for path in seal).encode()


if __name__ == "__main__":
    main()
