#!/usr/bin/env python3
"""run_page.py PAGE.md BIN SOURCE WORK: does what a page of docs/ says, in an empty folder.

Runs its ```sh blocks, in order and in one shell, with the programs of BIN on the PATH, and checks that its
```cpp FILE blocks are in that file of SOURCE, word for word.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys


def blocks(text):
    """(language, rest of the first line, content) of every fenced block."""
    return [m.groups() for m in re.finditer(r"^```(\w+) *(.*?)\n(.*?)^```$", text, re.M | re.S)]


def main():
    page, programs, source, work = map(pathlib.Path, sys.argv[1:])
    found = blocks(page.read_text())
    shell = "".join(content for language, _, content in found if language == "sh")
    if not shell:
        sys.exit(f"{page}: has no commands")
    for language, name, content in found:
        if language == "cpp" and content not in (source / name).read_text():
            sys.exit(f"{page}: this is not in {name}:\n{content}")
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    (work / "worlds").symlink_to((source / "worlds").resolve())
    environment = dict(os.environ, PATH=f"{programs.resolve()}:{os.environ['PATH']}")
    done = subprocess.run(["bash", "-euxo", "pipefail", "-c", shell], cwd=work, env=environment)
    sys.exit(done.returncode)


main()
