"""Read an ini file of LinuxCNC strictly: no key twice but REMAP, which comes once a code."""

import configparser
import re


def read_ini(text):
    """Read it into sections; ``REMAP = M428 ...`` becomes ``REMAP M428 = ...``."""
    ini = configparser.ConfigParser(strict=True, interpolation=None, inline_comment_prefixes=None)
    ini.optionxform = str
    ini.read_string(re.sub(r"\nREMAP = (M\d+)", r"\nREMAP \1 =", text))
    return ini
