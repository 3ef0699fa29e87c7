"""``parakin design``: a machine's sizes from what it is to do."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..errors import InputError, quote, suggest
from .console import announce_compiling, fixed, print_json
from .options import Json
from .regions import length

_DIGITS = 4  # of lengths


def _families(context: object) -> list[str]:
    from ..performance.design import DESIGNS

    return list(DESIGNS)


def design(
    family: Annotated[str, Parameter(completer=_families)],
    /,
    *,
    cube: Annotated[str, Parameter(allow_leading_hyphen=True)],
    amplification: Annotated[float, Parameter(allow_leading_hyphen=True)],
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    json: Json = False,
) -> int:
    """The sizes of a machine whose velocity amplification stays within bounds all over a cube.

    Parameters
    ----------
    family
        What kind of machine: orthoglide.
    cube
        The cube's edge, mm.
    amplification
        The greatest velocity amplification L allowed in it, above 1; the least is 1/L.
    output
        A machine file to write, .yaml.
    """
    edge = length(cube, "--cube")
    assert edge is not None
    if output is not None and output.suffix.lower() not in (".yaml", ".yml"):
        raise InputError(f'"{output}": expected a file name that ends in .yaml', "--output")
    announce_compiling()
    from ..performance.design import DESIGNS

    if family not in DESIGNS:
        raise InputError(f"unknown family {quote(family)}{suggest(family, DESIGNS)}", "design")
    found = DESIGNS[family](edge, amplification)
    files: dict[str, str] = {}
    if output is not None:
        from ..export.design import design_yaml
        from ..export.files import write_all

        write_all(output.parent, {output.name: design_yaml(found)})
        files["machine"] = str(output)
    low, high = found.cube
    least, greatest = found.proof.brackets
    if json:
        print_json(
            {
                "schema": "parakin.design/1",
                "family": family,
                "edge": found.edge,
                "amplification": found.amplification,
                "rod": found.rod,
                "stroke": list(found.stroke),
                "cube": [[low] * 3, [high] * 3],
                "verdict": found.proof.verdict,
                "tolerance": found.proof.tolerance,
                "psi": {"least": [least.low, least.high], "greatest": [greatest.low, greatest.high]},
                "files": files,
            }
        )
        return 0
    bound = f"{found.amplification:.9g}"
    print(f"{family} for a cube of {found.edge:.9g} mm, 1/{bound} <= psi <= {bound}\n")
    print(f"rod     {fixed(found.rod, _DIGITS)} mm")
    print(f"stroke  {fixed(found.stroke[0], _DIGITS)} to {fixed(found.stroke[1], _DIGITS)} mm")
    print(f"cube    {fixed(low, _DIGITS)} to {fixed(high, _DIGITS)} mm on each axis")
    verdict = f"{found.proof.verdict} to {found.proof.tolerance:g}"
    print(f"psi     {least.attained:.6f} to {greatest.attained:.6f}, {verdict}")
    if output is not None:
        print(f"\nmachine {output}")
    return 0
