"""``parakin design``: a machine's sizes from what it must do, by search and proof or in closed form."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ..budget import SECONDS
from ..errors import InputError, quote, suggest
from ..export.json.design import encode_design
from ..export.number_format import format_fixed
from .console import announce_compiling, print_json, print_text
from .options import YAML_ENDINGS, Json, OutputPath, complete_problem, require_ending
from .region_options import parse_length

if TYPE_CHECKING:
    from ..performance.design import Design

_DIGITS = 4  # digits of lengths


def design(
    family: Annotated[str, Parameter(completer=complete_problem)],
    /,
    *,
    cube: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    amplification: Annotated[float | None, Parameter(allow_leading_hyphen=True)] = None,
    output: OutputPath = None,
    count: int = 7,
    time: Annotated[float, Parameter(allow_leading_hyphen=True)] = SECONDS,
    json: Json = False,
) -> int:
    """A machine's sizes from what it must do: searched for, and proved all over a box of poses.

    Parameters
    ----------
    family
        A design problem, .yaml: machine, free numbers, box, bounds, what to minimise. Or orthoglide, whose sizes for a
        cube and an amplification are known in closed form.
    cube
        Of orthoglide: the cube's edge, mm.
    amplification
        Of orthoglide: the greatest velocity amplification L allowed in it, above 1; the least is 1/L.
    output
        Of orthoglide a machine file to write, .yaml; of a problem a folder for a machine file of each design, a picture
        of the front and its page, or the page alone, .html: the front, each design with its machine file and moving.
    count
        How many designs of the front of two objectives.
    time
        How long to search and to prove, s.
    """
    if family.lower().endswith(YAML_ENDINGS):
        if cube is not None or amplification is not None:
            raise InputError("the file of a problem says that", "--cube" if cube is not None else "--amplification")
        from .design_search import design_by_search

        return design_by_search(Path(family), output, count, time, json)
    if cube is None or amplification is None:
        _refuse_family(family)
        raise InputError("expected beside a family's name", "--cube" if cube is None else "--amplification")
    edge = parse_length(cube, "--cube")
    assert edge is not None
    require_ending(output, YAML_ENDINGS)
    announce_compiling()
    _refuse_family(family)
    from ..performance.design import DESIGNS

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


def _refuse_family(family: str) -> None:
    """Refuse a family without a closed form."""
    from ..performance.design import DESIGNS

    if family not in DESIGNS:
        others = f"{', '.join(DESIGNS)} or the .yaml file of a design problem"
        raise InputError(f"unknown family {quote(family)}{suggest(family, DESIGNS, others)}", "design")


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
