"""Runs a build and copies what it built to where Meson expects it.

Cargo has no stable way to name the file that it writes.
"""

import argparse
import pathlib
import shutil
import subprocess
import sys


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--built", type=pathlib.Path, required=True, help="file that the build writes")
    parser.add_argument("--copy", type=pathlib.Path, required=True, help="where to copy it")
    parser.add_argument("build", nargs=argparse.REMAINDER, help="the build's command line")
    arguments = parser.parse_args()
    status = subprocess.run(arguments.build, check=False).returncode
    if status == 0:
        shutil.copy2(arguments.built, arguments.copy)
    return status


if __name__ == "__main__":
    sys.exit(main())
