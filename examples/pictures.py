"""The pictures of the README and the documentation: every shipped machine at home.

python examples/pictures.py [-o FOLDER]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import parakin as pk


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/pictures"))
    folder = parser.parse_args().output
    for path in pk.write_files(
        folder, {f"{name}.png": pk.render_machine_picture(pk.load(name)) for name in pk.machines()}
    ):
        print(path)


if __name__ == "__main__":
    main()
