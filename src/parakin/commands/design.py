"""``parakin design``: a machine's sizes from the amplification that it must keep."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ..errors import InputError, quote, suggest
from ..export.json.design import encode_design
from ..export.number_format import format_fixed
from .console import announce_compiling, print_json, print_text
from .options import Json
from .region_options import parse_length

if TYPE_CHECKING:
    from ..performance.design import Design

_DIGITS = 4  # digits of lengths


def _list_families(context: object) -> list[str]:
    from ..performance.design import DESIGNS

    return list(DESIGNS)


def design(
    family: Annotated[str, Parameter(completer=_list_families)],
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
    edge = parse_length(cube, "--cube")
    assert edge is not None
    if output is not None and output.suffix.lower() not in (".yaml", ".yml"):
        raise InputError(f'"{output}": expected a file name that ends in .yaml', "--output")
    announce_compiling()
    from ..performance.design import DESIGNS

    if family not in DESIGNS:
        raise InputError(f"unknown family {quote(family)}{suggest(family, DESIGNS)}", "design")
    result = DESIGNS[family](edge, amplification)
    files: dict[str, str] = {}
    if output is not None:
        from ..export.design import format_design_yaml
        from ..export.files import write_files

        write_files(output.parent, {output.name: format_design_yaml(result)})
        files["machine"] = str(output)
    if json:
        print_json(encode_design(result, files))
        return 0
    print_text(_format_design(result))
    if output is not None:
        print_text(f"\nmachine {output}")
    return 0


def _format_design(design: Design) -> str:
    (low, high), (first, last) = design.cube, design.stroke
    least, greatest = design.proof.brackets
    bound, verdict = f"{design.amplification:.9g}", f"{design.proof.verdict} to {design.proof.tolerance:g}"
    return "\n".join(
        [
            f"{design.family} for a cube of {design.edge:.9g} mm, 1/{bound} <= psi <= {bound}\n",
            f"rod     {format_fixed(design.rod, _DIGITS)} mm",
            f"stroke  {format_fixed(first, _DIGITS)} to {format_fixed(last, _DIGITS)} mm",
            f"cube    {format_fixed(low, _DIGITS)} to {format_fixed(high, _DIGITS)} mm on each axis",
            f"psi     {least.attained:.6f} to {greatest.attained:.6f}, {verdict}",
        ]
    )
